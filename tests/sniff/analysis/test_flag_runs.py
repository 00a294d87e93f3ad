"""Whether an error flag covers one octet or a whole read."""

from __future__ import annotations

from sniff.analysis.flag_runs import FlagRuns


def test_marks_that_fill_reads_and_go_on_into_good_frames_cover_reads() -> None:
    runs = FlagRuns()
    for _ in range(2):
        runs.see([5, 6, 7], 8, True)  # the end of a good request
        runs.see(list(range(9)), 9, False)  # and the damaged answer behind it, in the same read
        runs.see([], 8, True)
    assert runs.cover_reads


def test_errors_of_single_octets_do_not_cover_reads() -> None:
    runs = FlagRuns()
    for at in range(20):
        runs.see([at % 8], 8, at % 5 == 0)
    assert not runs.cover_reads


def test_a_burst_that_spoils_every_frame_it_strikes_does_not_cover_reads() -> None:
    runs = FlagRuns()
    for _ in range(10):
        runs.see([2, 3, 4, 5, 6], 8, False)
        runs.see([], 8, True)
    assert not runs.cover_reads


def test_half_of_all_octets_marked_is_a_setting_of_the_port() -> None:
    runs = FlagRuns()
    for _ in range(10):
        runs.see([0, 1, 4, 6, 7], 9, True)
        runs.see([1, 2, 3, 4, 7], 9, True)
    assert not runs.cover_reads
