"""What BACnet messages say, in the shared captures: segments, addresses behind routers, weekdays, reply bits."""

from __future__ import annotations

from dissectors.bacnet import MSTP
from dissectors.bacnet.readings import readings
from dissectors.findings import Severity
from dissectors.frame import Frame, Role
from dissectors.tracker import Verdict
from sniff.analysis.packet_tree import Field, fields_of
from sniff.analysis.wording import describe
from tests.cases.reading import CaseReading, case, reading


def frame(found: CaseReading, no: int) -> Frame:
    event = found.rows[no - 1].event
    assert isinstance(event, Frame)
    return event


def line(found: CaseReading, no: int) -> str:
    return describe(MSTP, found.rows[no - 1])


def values(found: CaseReading, no: int) -> dict[str, list[str]]:
    """Everything in the tree of a frame, by name."""
    shown: dict[str, list[str]] = {}

    def take(fields: tuple[Field, ...]) -> None:
        for field in fields:
            shown.setdefault(field.name, []).append(field.value)
            take(field.children)

    take(fields_of(MSTP, frame(found, no), Role.RESPONSE))
    return shown


def test_a_correct_segmented_answer_is_one_answer_and_its_list_is_there():
    found = reading(case("mstp/segmented-answer-normal.cap.txt"))
    (asked,) = [one for one in found.transactions if not one.is_passing]
    assert (asked.verdict, asked.request, asked.response) == (Verdict.ANSWERED, 2, 10)
    assert found.graves() == set()
    assert found.health.bus.score == 100
    assert all(health.score == 100 for health in found.health.stations.values())
    objects = readings(frame(found, 2), frame(found, 10))
    assert [one.value for one in objects] == [f"analog-value,{number}" for number in range(60)]
    assert line(found, 10).startswith("5 → 1 read-property ack segment 1, last of 2: device,5 object-list = [analog-")
    shown = values(found, 10)
    assert shown["frames"] == ["3, 10"]
    assert shown["[60]"] == ["analog-value,59"]  # the 60th element
    assert str(MSTP.fields(frame(found, 10), Role.RESPONSE)["bacapp.instance_number"]).endswith(",58,59")


def test_addresses_behind_a_router_are_decimal():
    found = reading(case("mstp/mac-16-behind-router.cap.txt"))
    assert "network 13:16" in line(found, 2)
    assert "network 13:61" in line(found, 3)
    assert values(found, 2)["dadr"] == ["16"]
    assert values(found, 3)["sadr"] == ["61"]
    assert found.graves() == set()


def test_a_weekday_that_does_not_fit_is_said():
    found = reading(case("mstp/bacpypes523-wrong-weekday.cap.txt"))
    words = "2024-04-05 Thursday (it is a Friday)"
    assert words in line(found, 2)
    assert values(found, 2)["date"] == [words]
    (note,) = [one for one in found.findings if one.code == "MS702"]
    assert (note.severity, note.subject, note.evidence) == (Severity.NOTE, "MAC 1", (2,))
    assert words in note.seen
    assert found.graves() == set()


def test_a_confirmed_request_without_the_reply_bit_is_said():
    found = reading(case("mstp/issue916-confirmed-without-reply-bit.cap.txt"))
    assert "(confirmed, no reply expected)" in line(found, 2)
    assert any("cannot be answered at once" in value for value in values(found, 2)["expects reply"])
    (note,) = [one for one in found.findings if one.code == "MS701"]
    assert (note.severity, note.subject, note.count) == (Severity.NOTE, "MAC 1", 4)
    assert found.graves() == set()
    asked = [one for one in found.transactions if not one.is_passing]
    assert [one.verdict for one in asked] == [Verdict.ANSWERED] * 4
