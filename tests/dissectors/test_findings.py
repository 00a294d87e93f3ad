"""What an error explains is a note that names it; words for counts."""

from __future__ import annotations

from dataclasses import replace

from dissectors.findings import (
    EVIDENCE_MAX,
    Finding,
    Rule,
    Severity,
    Tally,
    counted,
    from_the_root,
    times,
    together,
    under_causes,
    with_consequences,
)

RULES = {
    "XX1": Rule("XX1", Severity.ERROR, "two senders", "", explains=("XX2", "YY")),
    "XX2": Rule("XX2", Severity.WARNING, "damage", ""),
    "XX3": Rule("XX3", Severity.WARNING, "slow", ""),
    "ZZ1": Rule("ZZ1", Severity.WARNING, "errors", "", told_by=("XX2",)),
}


def finding(code: str, subject: str, severity: Severity = Severity.WARNING) -> Finding:
    return Finding(code, severity, subject, 0, 9, 4, (7,), "seen", "means", "next")


def after(*findings: Finding) -> dict[tuple[str, str], Finding]:
    made = with_consequences(findings, RULES)
    assert [(one.code, one.subject, one.seen, one.count) for one in made] == [
        (one.code, one.subject, one.seen, one.count) for one in findings
    ]
    return {(one.code, one.subject): one for one in made}


def test_an_error_about_the_bus_explains_everybodys_trouble() -> None:
    made = after(finding("XX1", "bus", Severity.ERROR), finding("XX2", "station 3"), finding("YY7", "master"))
    assert made["XX1", "bus"].severity is Severity.ERROR
    for key in (("XX2", "station 3"), ("YY7", "master")):
        assert made[key].severity is Severity.NOTE
        assert made[key].means == "most likely a consequence of XX1 (bus: two senders)"
        assert made[key].next.startswith("settle XX1 first")


def test_what_it_does_not_name_stays() -> None:
    other = finding("XX3", "station 3")
    assert after(finding("XX1", "bus", Severity.ERROR), other)["XX3", "station 3"] == other


def test_an_error_about_a_station_explains_that_station_and_the_bus_only() -> None:
    made = after(
        finding("XX1", "station 2", Severity.ERROR),
        finding("XX2", "station 2"),
        finding("XX2", "station 3"),
        finding("YY1", "bus"),
    )
    assert made["XX2", "station 2"].severity is Severity.NOTE
    assert made["XX2", "station 3"].severity is Severity.WARNING
    assert made["YY1", "bus"].severity is Severity.NOTE


def test_a_warning_explains_no_error_and_an_information_is_not_raised() -> None:
    assert after(finding("XX1", "bus"), finding("XX2", "bus"))["XX2", "bus"].severity is Severity.NOTE
    grave = finding("XX2", "bus", Severity.ERROR)
    assert after(finding("XX1", "bus"), grave)["XX2", "bus"].severity is Severity.ERROR
    low = finding("XX2", "bus", Severity.INFO)
    assert after(finding("XX1", "bus", Severity.ERROR), low)["XX2", "bus"].severity is Severity.INFO


def test_a_consequence_names_its_cause_and_explains_nothing_itself() -> None:
    rules = {
        "A": Rule("A", Severity.ERROR, "a", "", explains=("B",)),
        "B": Rule("B", Severity.ERROR, "b", "", explains=("A", "C")),
        "C": Rule("C", Severity.WARNING, "c", ""),
    }
    made = with_consequences([finding("A", "bus", Severity.ERROR), finding("B", "bus"), finding("C", "bus")], rules)
    assert [one.cause for one in made] == [None, ("A", "bus"), None]


def test_what_a_consequence_had_explained_before_comes_of_the_same_cause() -> None:
    rules = {
        "A": Rule("A", Severity.WARNING, "a", "", explains=("B",)),
        "B": Rule("B", Severity.WARNING, "b", "", explains=("C",), told_by=("D",)),
        "C": Rule("C", Severity.WARNING, "c", ""),
        "D": Rule("D", Severity.WARNING, "d", ""),
    }
    for root in ("A", "D"):
        made = with_consequences([finding("B", "bus"), finding("C", "bus"), finding(root, "bus")], rules)
        assert [one.cause for one in made] == [(root, "bus"), (root, "bus"), None], root
        assert made[1].next.startswith(f"settle {root} first")
        assert [(one.code, under) for one, under in under_causes(made)] == [(root, False), ("B", True), ("C", True)]


def test_causes_that_name_each_other_end() -> None:
    rings = [replace(finding(code, "bus"), cause=(other, "bus")) for code, other in ("XY", "YZ", "ZX")]
    assert from_the_root(rings, RULES) == tuple(rings)


def test_a_note_explains_nothing() -> None:
    made = after(finding("XX1", "bus", Severity.NOTE), finding("XX2", "bus", Severity.NOTE))
    assert made["XX2", "bus"].cause is None


def test_words_for_counts() -> None:
    assert [times(count) for count in (1, 2, 3)] == ["once", "twice", "3 times"]
    assert [counted(count, "answer") for count in (0, 1, 2)] == ["0 answers", "1 answer", "2 answers"]
    assert counted(2, "stretch", "stretches") == "2 stretches"


def test_one_trouble_is_told_once_by_what_tells_it_better() -> None:
    made = after(
        finding("ZZ1", "station 2"), finding("ZZ1", "bus"), finding("ZZ1", "station 3"), finding("XX2", "station 2")
    )
    for subject in ("station 2", "bus"):
        assert made["ZZ1", subject].cause == ("XX2", "station 2")
        assert made["ZZ1", subject].means == "most likely the same trouble as XX2 (station 2: damage)"
    assert made["ZZ1", "station 3"].cause is None


def test_the_trouble_of_the_bus_is_not_one_of_two_stations() -> None:
    made = after(finding("ZZ1", "bus"), finding("XX2", "station 2"), finding("XX2", "station 3"))
    assert made["ZZ1", "bus"].severity is Severity.WARNING


def test_what_names_its_own_cause_and_what_is_told_by_a_mere_consequence_stand_for_themselves() -> None:
    apart = replace(finding("ZZ1", "bus"), is_told_apart=True)
    assert after(apart, finding("XX2", "bus"))["ZZ1", "bus"] == apart
    made = after(finding("ZZ1", "bus"), finding("XX2", "bus"), finding("XX1", "bus"))
    assert (made["ZZ1", "bus"].cause, made["XX2", "bus"].cause) == (None, ("XX1", "bus"))


def test_many_are_counted_as_one_by_one_whatever_their_times() -> None:
    groups = ([50, 20, 90], [], [10], [70, 200, 3], list(range(100, 120)))
    one_by_one, at_once, apart, no = Tally(), Tally(), [], 0
    for group in groups:
        frames = range(no, no + len(group))
        no += len(group)
        for frame, time in zip(frames, group, strict=True):
            one_by_one.add(time, frame)
        at_once.add_many(group, frames)
        apart.append(Tally())
        apart[-1].add_many(group, frames)
        assert at_once == one_by_one == together(apart)
    assert (at_once.count, at_once.first, at_once.last) == (27, 3, 200)
    assert at_once.evidence == list(range(EVIDENCE_MAX))


def test_where_all_frames_have_their_place_taken_more_are_only_counted() -> None:
    tally = Tally()
    tally.add(5, *range(EVIDENCE_MAX + 1))
    tally.add_many([6, 7], [98, 99])
    assert (tally.count, tally.last) == (3, 7)
    assert not {98, 99} & set(tally.evidence)
