"""Damage of frames that a late read tore is nobody's; any other damage stays."""

from dissectors.frame import Check, Damage, Found, Frame
from dissectors.line import LineSettings, Timing
from dissectors.n2.record import Damages
from dissectors.n2.torn import TornFrames

TIMING = Timing(LineSettings.parse("9600,8N1"), 0)


def _frame(octets: bytes, *, slack: int = 0, damage: Damage | None = None) -> Frame:
    check = Check.GOOD if damage is None else Check.BAD
    return Frame("n2", octets, 0, 1_000_000, check, Found.DELIMITER, damage, slack=slack)


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
