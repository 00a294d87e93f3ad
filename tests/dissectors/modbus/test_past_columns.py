"""What many frames teach at once is what they teach one after the other, also where old requests are forgotten."""

from __future__ import annotations

from dissectors.columns import ROLES
from dissectors.frame import Role
from dissectors.modbus.kernel import kernel
from dissectors.modbus.past import Past
from dissectors.modbus.past_columns import learn
from tests.bench import bulk_rtu


def test_the_same_requests_are_remembered() -> None:
    reads = bulk_rtu.bus(*bulk_rtu.frames(6000), bulk_rtu.TIMING)
    frames = kernel(reads, bulk_rtu.TIMING)
    said = [frames.frame(row, reads.octets, "modbus-rtu", 0).octets for row in range(len(frames))]
    answers = (frames.role == ROLES.index(Role.RESPONSE)).tolist()
    one_by_one, at_once = Past(), Past()
    for octets, is_answer in zip(said, answers, strict=True):
        one_by_one.note(octets, request=not is_answer)
    for begin, end in ((0, 5), (5, 3000), (3000, 3001), (3001, len(frames))):
        learn(at_once, set(), frames, reads.octets, begin, end)
    remembered = {octets for octets in said if one_by_one.has_asked(octets)}
    assert 0 < len(remembered) < len(set(said)) // 2
    assert {octets for octets in said if at_once.has_asked(octets)} == remembered
