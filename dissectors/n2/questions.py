"""The questions in N2 commands: an object, or one of its attributes; polls and the like name nothing."""

from __future__ import annotations

from dissectors.frame import Frame
from dissectors.n2.commands import parse_command
from dissectors.n2.objects import region_name
from dissectors.n2.readings import part_of
from dissectors.questions import Question, Span


def question(frame: Frame) -> Question:
    """See `dissectors.questions.Questions`."""
    if frame.octets[:1] != b">":
        return Question()
    command = parse_command(frame.octets)
    if command.region is None or command.object is None:
        return Question()
    part, writes = part_of(command.region, command.attribute), bool(command.data)
    return Question((Span(region_name(command.region), command.object, 1, part, writes),))
