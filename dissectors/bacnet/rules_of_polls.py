"""The rules about polls for masters (MS2)."""

from __future__ import annotations

from dissectors.findings import Rule, Severity

POLL_RULES = (
    Rule(
        "MS201",
        Severity.WARNING,
        "too many polls for masters",
        "A station polls for a new master once in 50 tokens (Npoll); more than one in 10 is counted here, "
        "with the share of time that unanswered polls take. Polls of a search for a successor, the first one or a lost "
        "one, do not count; what is no good frame may have been a token, and counts as one. Where half of all masters "
        "do so, and two at least, it is one finding about the bus, and theirs are noted under it. But searches after a "
        "loss that stopped the bus for over a second are said, with their cost, and so are polls of many addresses "
        "with one token where nobody was lost.",
        "a station that does not count to Npoll, or polls far beyond the last address",
        "Max_Master and firmware of the stations named; gaps in the addresses",
    ),
    Rule(
        "MS202",
        Severity.WARNING,
        "slow to answer a poll",
        "A Reply To Poll For Master came later than 15 ms (Tusage_delay) after the poll. A single one is only noted.",
        "the station risks not being taken into the ring",
        "load and firmware of the station",
    ),
    Rule(
        "MS203",
        Severity.WARNING,
        "slow between polls",
        "Half of the polls for masters that nobody answers, and five at least, are followed by the station's "
        "next frame "
        "only after more than 100 ms; 20 … 35 ms (Tusage_timeout) are usual.",
        "an overloaded station or a wrong time in its program: a search for a master takes minutes, and it may "
        "hold the "
        "token for as long",
        "firmware, load and settings of the station",
    ),
    Rule(
        "MS204",
        Severity.WARNING,
        "does not wait for the answer to a poll",
        "A station sent again sooner than the one that it polled could have answered (8 ms), three times and more.",
        "a wrong time in its program: it finds no other station",
        "firmware and settings of the station (Tusage_timeout is 20 … 35 ms)",
    ),
    Rule(
        "MS205",
        Severity.WARNING,
        "does not take the answer to a poll",
        "A station that was polled answered within 20 ms (Tusage_timeout), and the one that polled sent something else "
        "than the token for it, which it must pass on at once (ASHRAE 135, 9.5.6). Once or twice is only noted: the "
        "answer may have been damaged there alone.",
        "it does not hear the answer, because its receiver is not switched on yet or is too far away, or its program "
        "drops it; who answered stays out of the ring",
        "turnaround and firmware of the station named; the wiring between it and those that answer",
    ),
    Rule(
        "MS206",
        Severity.NOTE,
        "polls beyond its successor",
        "A station that has lost nobody polls three addresses and more that do not lie between it and the station to "
        "which it passes its token; only there it may have to find one (ASHRAE 135, 9.5.6).",
        "its Max_Master is lower than its own address, or its program looks for new stations wrongly: whoever answers "
        "there is taken for its successor, and those between fall out of the ring; between them it finds nobody",
        "Max_Master and firmware of the station",
    ),
)
