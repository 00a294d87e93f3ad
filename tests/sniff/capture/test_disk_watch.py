"""What is told of a disk that does not keep up: when it begins, when it gets worse, when it is over; no more."""

from __future__ import annotations

from sniff.capture.disk_watch import AGAIN, SLOW, DiskWatch

S = 1_000_000_000


def test_a_disk_that_keeps_up_is_no_news() -> None:
    watch = DiskWatch()
    assert [watch.see(second * S, SLOW - 1, SLOW - 1, 0) for second in range(100)] == [None] * 100
    assert watch.behind == 0


def test_a_jam_is_told_at_its_beginning_when_it_is_twice_as_bad_and_at_its_end() -> None:
    watch = DiskWatch()
    told = [watch.see(second * S, second * S, 0, 0) for second in range(20)]
    assert [(at, text) for at, text in enumerate(told) if text] == [
        (2, "disk slow: 2 s behind"),
        (4, "disk slow: 4 s behind"),
        (8, "disk slow: 8 s behind"),
        (16, "disk slow: 16 s behind"),
    ]
    assert watch.behind == 19 * S
    assert watch.see(20 * S, 0, 0, 0) == "the disk has caught up: it was 19 s behind, nothing lost"
    assert watch.behind == 0
    assert watch.see(21 * S, 0, 0, 0) is None


def test_what_is_lost_is_told() -> None:
    watch = DiskWatch()
    watch.see(0, 0, 0, 7)
    assert watch.see(2 * S, 2 * S, 0, 7) == "disk slow: 2 s behind"
    assert watch.see(4 * S, 4 * S, 0, 507) == "disk slow: 4 s behind; 500 octets lost, memory is full"
    assert watch.see(5 * S, 0, 0, 1007) == "the disk has caught up: it was 4 s behind, 1000 octets lost"


def test_a_sync_that_hangs_is_another_matter() -> None:
    watch = DiskWatch()
    assert watch.see(2 * S, 0, 2 * S, 0) == "disk slow: syncing takes 2 s"
    assert watch.see(3 * S, 0, 0, 0) == "the disk has caught up: it was 2 s behind, nothing lost"


def test_a_card_that_is_always_slow_is_not_told_again_and_again() -> None:
    watch = DiskWatch()
    told = []
    for second in range(300):
        syncing = max(0, second % 8 - 2)
        text = watch.see(second * S, 0, syncing * S, 0)
        told += [second] if text and text.startswith("disk slow") else []
    assert len(told) <= 2 + 2 * (300 * S // AGAIN)


def test_what_has_another_reason_neither_begins_a_jam_nor_ends_one() -> None:
    """A full disk is said as such; that nothing is looked at meanwhile is not that the disk has caught up."""
    watch = DiskWatch()
    watch.excuse(100)
    assert watch.see(S, 3 * S, 0, 100) == "disk slow: 3 s behind"
    watch.excuse(400)
    assert watch.behind == 0
    assert watch.see(3 * S, 5 * S, 0, 400) is None
    assert watch.see(4 * S, 0, 0, 400) == "the disk has caught up: it was 5 s behind, 300 octets lost"
