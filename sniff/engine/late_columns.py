"""The slack that late reads leave to frames, for many reads at once: what `late_reads.py` says one by one. Pure."""

from __future__ import annotations

from typing import Self

import numpy as np

from dissectors.columns import Reads, Times, places_in
from dissectors.line import Timing
from sniff.engine.late_reads import ANOTHER, KEPT, MOST, OFTEN, RARELY, TOGETHER, LateReads
from sniff.engine.read_times import FAST, Backlog


class LateColumns:
    """Fed blocks of reads whose times do not run backwards; gives frames their slack."""

    def __init__(self, timing: Timing) -> None:
        self._char = timing.char
        self._least = timing.latency + ANOTHER * timing.char
        self._together = timing.latency + TOGETHER
        self._allowed = self._latency = timing.latency
        self._backlog = Backlog(timing.char, timing.latency + timing.char)
        self._seen = 0
        self._before_run = 0
        self._times = np.zeros(0, np.int64)  # of the last reads
        self._starts = np.zeros(0, np.int64)
        self._pauses = np.full(0, -1, np.int64)
        self._latencies = np.zeros(0, np.int64)
        self._is_late = np.zeros(0, bool)
        self._is_plain = False  # no read is long, none tells a latency that is not allowed for already

    @classmethod
    def after(cls, earlier: LateReads, timing: Timing) -> Self:
        """Go on where reads were seen one by one."""
        columns, kept = cls(timing), list(earlier.kept)
        columns._latency, columns._backlog = earlier.latency, earlier.backlog
        columns._seen, columns._before_run = earlier.seen, earlier.before_run
        columns._times = np.array([read.time for read in kept], np.int64)
        columns._starts = np.array([read.start for read in kept], np.int64)
        columns._pauses = np.array([read.pause for read in kept], np.int64)
        columns._latencies = np.array([read.latency for read in kept], np.int64)
        columns._is_late = np.array([read.is_late for read in kept], bool)
        return columns

    def one_by_one(self, timing: Timing) -> LateReads:
        """What goes on from here where reads are seen one by one."""
        later = LateReads(timing)
        later.backlog = self._backlog
        columns = (self._starts, self._times, self._pauses, self._latencies, self._is_late)
        kept = zip(*(column[-KEPT:].tolist() for column in columns), strict=True)
        later.go_on(kept, self._latency, self._seen, self._before_run)
        return later

    def see(self, reads: Reads) -> None:
        """Take the reads that follow."""
        times, lasted = reads.times, reads.lengths * self._char
        before = np.empty(len(reads), np.int64)
        known = len(self._times) > 0
        before[0] = self._times[-1] if known else times[0] - lasted[0]
        before[1:] = times[:-1]
        runs = times - lasted - before > self._together
        if not known:
            runs[0] = True
        starts = np.maximum(times - lasted, before)
        if not known:
            starts[0] = times[0] - lasted[0]
        long = lasted > self._least
        long[0] &= known
        pauses = self._pauses_before(np.flatnonzero(long), np.flatnonzero(runs), before, starts)
        latencies = self._follow(reads, before, known)
        self._times = np.concatenate((self._times[-KEPT:], times))
        self._starts = np.concatenate((self._starts[-KEPT:], starts))
        self._pauses = np.concatenate((self._pauses[-KEPT:], pauses))
        self._latencies = np.concatenate((self._latencies[-KEPT:], latencies))
        self._is_late = np.concatenate((self._is_late[-KEPT:], np.zeros(len(reads), bool)))
        self._is_plain = int(self._pauses.max()) < 0 and int(self._latencies.max()) <= self._allowed

    def _pauses_before(self, long: Times, runs: Times, before: Times, starts: Times) -> Times:
        """The pause before each long read, from the run of reads that it ends; -1 of the others. `runs`: which begin
        one."""
        pauses = np.full(len(before), -1, np.int64)
        if len(long):
            at = runs.searchsorted(long, "right") - 1
            began = before[runs[np.maximum(at, 0)]] if len(runs) else np.zeros(len(long), np.int64)
            pauses[long] = np.minimum(starts[long] - np.where(at >= 0, began, self._before_run), MOST)
        if len(runs):
            self._before_run = int(before[runs[-1]])
        return pauses

    def slack(self, ends: Times) -> Times:
        """ns, of frames in their order, none of them twice, by when they ended; their reads were seen."""
        if self._is_plain:
            return np.full(len(ends), self._allowed, np.int64)
        read = places_in(self._times, ends)
        inside = read < len(self._times)
        read = np.minimum(read, len(self._times) - 1)
        within = inside & (self._starts[read] < ends)
        slack: Times = np.where(within, np.maximum(self._latencies[read], self._allowed), self._allowed)
        pauses = self._pauses[read]
        held = within & (pauses >= 0)
        self._is_late[read[held & (self._times[read] - ends >= self._least)]] = True
        return np.where(held & self._is_late[read], np.maximum(slack, pauses), slack)

    def _follow(self, reads: Reads, before: Times, known: bool) -> Times:
        """The latency in force after each read: where reads hold more than can have come, it grows."""
        intervals, backlog = reads.times - before, self._backlog
        summed = np.cumsum(FAST * reads.lengths * self._char - intervals)
        if not known:
            summed -= summed[0]
        summed += backlog.now
        now = summed - np.minimum(np.minimum.accumulate(summed), 0.0)
        if backlog.is_over or now.max() > backlog.allowed:
            return self._one_by_one(reads, intervals, known)
        self._seen += len(reads)
        backlog.now = float(now[-1])
        return np.full(len(reads), self._latency, np.int64)

    def _one_by_one(self, reads: Reads, intervals: Times, known: bool) -> Times:
        latencies, backlog = [], self._backlog
        for at, (interval, octets) in enumerate(zip(intervals.tolist(), reads.lengths.tolist(), strict=True)):
            self._seen += 1
            if (known or at) and backlog.add(interval, octets):
                stretches = backlog.stretches
                if stretches >= OFTEN and RARELY * stretches >= self._seen:
                    self._latency = min(MOST, max(self._latency, int(backlog.worst)))
            latencies.append(self._latency)
        return np.array(latencies, np.int64)
