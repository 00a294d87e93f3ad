"""Questions to a capture that the expected reading does not answer by itself."""

from dissectors.tracker import Verdict


def test_the_pump_answers_quickly(capture):
    reading = capture("poll")
    answered = [transaction for transaction in reading.transactions if transaction.verdict is Verdict.ANSWERED]
    assert answered
    assert all(transaction.latency.high < 50_000_000 for transaction in answered)  # ns


def test_only_unit_1_is_on_the_bus(capture):
    assert set(capture("poll").nodes) == {1}


def test_our_own_master_sends_what_the_drive_expects(craft):
    assert craft("modbus-rtu", unit=1, pdu=bytes.fromhex("0300000002")) == bytes.fromhex("010300000002C40B")
