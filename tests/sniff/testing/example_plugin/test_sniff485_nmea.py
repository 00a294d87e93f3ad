"""The framer of NMEA 0183 is a framer."""

from hypothesis import strategies as st
from sniff485_nmea import check_of, framer

from sniff.testing.framer_contract import framer_contract


def sentence(name: str, fields: list[str]) -> bytes:
    body = ",".join([name, *fields]).encode()
    return b"$" + body + b"*%02X\r\n" % check_of(body)


FIELDS = st.lists(st.text("0123456789.NSEW", max_size=9), max_size=6)
SENTENCES = st.builds(sentence, st.sampled_from(["GPGGA", "GPRMC", "WIMWV", "SDDBT"]), FIELDS)

TestNmeaContract = framer_contract(framer, SENTENCES, examples=10)
