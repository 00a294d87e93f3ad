"""Damage of frames that a late read tore is nobody's; any other damage stays."""

from dataclasses import replace

from dissectors.frame import Check, Chunk, Damage, Flaw, FoundBy, Frame, Noise, Place, Reason, Repair
from dissectors.line import MS, LineSettings, Timing
from dissectors.n2.envelope import make_answer
from dissectors.n2.record import Damages
from dissectors.n2.torn import TornFrames
from tests.dissectors.n2.heard import LINE, findings_of, in_turns

TIMING = Timing(LineSettings.parse("9600,8N1"), 0)


def _frame(octets: bytes, *, slack: int = 0, damage: Damage | None = None) -> Frame:
    check = Check.GOOD if damage is None else Check.BAD
    return Frame("n2", octets, 0, 1_000_000, check, FoundBy.DELIMITER, damage, slack=slack)


def _struck_by(*rows: Frame) -> int:
    torn, sender = TornFrames(TIMING), Damages()
    for no, frame in enumerate(rows):
        torn.see(no, frame, 1, is_good_frame=frame.damage is None)
        if frame.damage is not None:
            sender.add_bad(frame.end, no)
            torn.struck(sender)
    return sender.bad.count


def test_pieces_before_a_late_frame_are_no_damage() -> None:
    assert not _struck_by(_frame(b"A00400", damage=Damage.TIMEOUT), _frame(b">0104C5\r", slack=90_000_000))


def test_pieces_that_make_a_good_frame_are_no_damage() -> None:
    pieces = (_frame(b">0104", damage=Damage.TIMEOUT), _frame(b"C5\r", damage=Damage.FORM))
    torn, sender = TornFrames(TIMING), Damages()
    sender.add_bad(0, 0)
    torn.see(0, pieces[0], 1, is_good_frame=False)
    torn.struck(sender)
    torn.see(1, pieces[1], 1, is_good_frame=False)
    assert not sender.bad.count
    assert torn.is_torn(1, None)


def test_other_damage_stays() -> None:
    assert _struck_by(_frame(b"A00400", damage=Damage.TIMEOUT), _frame(b">0104C5\r")) == 1


def test_pieces_are_put_together_as_they_were_heard() -> None:
    """The last one alone looks like a refusal with its first octet spoilt, which is no part of the whole."""
    torn = TornFrames(TIMING)
    seems = Repair(Flaw.FIRST_SPOILT, b"NE4\r")
    torn.see(0, _frame(b"A0040000", damage=Damage.TIMEOUT), 1, is_good_frame=False)
    torn.see(1, Noise(b"00", 0, 1, Place.BEFORE, Reason.NO_DELIMITER), None, is_good_frame=False)
    torn.see(2, replace(_frame(b"0E4\r", damage=Damage.FORM), repair=seems), 1, is_good_frame=False)
    assert torn.completes(2)
    assert torn.is_torn(1, None)


def test_an_acknowledgement_has_no_check_and_is_whole_all_the_same() -> None:
    torn = TornFrames(TIMING)
    torn.see(0, _frame(b"A", damage=Damage.TIMEOUT), 1, is_good_frame=False)
    torn.see(1, Noise(b"\r", 0, 1, Place.BEFORE, Reason.PAD), None, is_good_frame=False)
    assert torn.is_torn(1, None)


def test_what_is_behind_a_torn_command_may_answer_it() -> None:
    torn = TornFrames(TIMING)
    torn.see(0, _frame(b">0104", damage=Damage.TIMEOUT), 1, is_good_frame=False)
    torn.see(1, _frame(b"C5\r", damage=Damage.FORM), 1, is_good_frame=False)
    torn.see(2, _frame(b"A\r"), 1, is_good_frame=True)
    torn.see(3, _frame(b"A\r"), 1, is_good_frame=True)
    assert torn.may_answer(2)
    assert not torn.may_answer(3)
    assert not torn.may_answer(None)


def test_an_answer_torn_to_noise_is_one() -> None:
    torn = TornFrames(TIMING)
    torn.see(0, _frame(b">0104C5\r"), 1, is_good_frame=True)
    torn.see(1, Noise(b"N1", 0, 1, Place.AFTER, Reason.NO_DELIMITER), None, is_good_frame=False)
    torn.see(2, Noise(b"1\r", 0, 1, Place.BEFORE, Reason.NO_DELIMITER), None, is_good_frame=False)
    assert torn.is_answered(0)
    assert not torn.is_answered(1)


def test_a_torn_answer_takes_back_no_damage_of_before() -> None:
    read, answer = b">0111010387\r", make_answer("00420000")
    good, spoilt, now = (read, answer), (read, bytes(range(0x81, 0x8D))), 0
    chunks = list(in_turns((good, good, good, spoilt) * 6, 100))
    for wait, octets in ((100, read), (12, answer[:9]), (600, answer[9:])):
        now = chunks[-1].time + wait * MS + len(octets) * LINE.char
        chunks.append(Chunk(now, octets))
    (told,) = (one for one in findings_of(chunks) if one.code == "N2004")
    assert (told.about.station, told.count) == (1, 6)
