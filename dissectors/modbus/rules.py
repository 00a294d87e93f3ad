"""The rules of Modbus: what each measures, against which limit, what it means and what to check next.

MB0xx answers that fail, MB1xx time, MB2xx addresses and masters, MB3xx gaps between octets and frames, MB4xx facts.
"""

from __future__ import annotations

from dissectors.findings import Rule, Severity
from dissectors.modbus.rules_of_answers import ANSWER_RULES

_OF_LINE = ("LN101", "LN103", "LN201", "LN202", "LN203", "LN204")

_OF_COLLISIONS = (
    *("MB005", "MB007", "MB008", "MB009", "MB010", "MB103", "MB104", "MB106", "MB107", "MB207", "MB208"),
    *(*_OF_LINE, "LN303"),
)
"""What two senders at once make of good frames."""

_OF_ANOTHER_TALKER = ("MB005", "MB007", "MB009", "MB104", "LN101", "LN103")
"""The damage that answers which nobody asked for do to frames that they fall on."""

_ALL = (
    *ANSWER_RULES,
    Rule(
        "MB101",
        Severity.WARNING,
        "slow station",
        "Response times, less all that the adapter may have added, above 70% of the master's timeout as seen on "
        "the bus, or above 500 ms while no timeout is known (then only noted). At least three and 1 in 100 of its "
        "answers. Answers after which the master hardly pauses were read late, not sent late, and do not count.",
        "a busy station, a gateway behind it, or a response delay set too high",
        "the station's response-delay setting and load; a longer timeout in the master",
    ),
    Rule(
        "MB102",
        Severity.WARNING,
        "response time drifts",
        "The median response time of the last quarter of the answers is over half as long again as that of the first "
        "quarter, and over 5 ms longer, by the bounds that the adapter leaves; it rose from quarter to quarter, and "
        "the quickest answers with it, and so it did of most requests, each compared with itself.",
        "a station that gets busier or fills up, and will run into the timeout",
        "its load and log; restart it and see whether the time falls back",
    ),
    Rule(
        "MB103",
        Severity.WARNING,
        "answers after the master gave up",
        "Good answers that come after the master's timeout, often into the next request.",
        "the master's timeout is too short for this station",
        "raise the master's response timeout above the times seen here",
        explains=("MB101", "MB104", "MB201", "MB208", "MB301", "MB005", "MB010", *_OF_LINE),
    ),
    Rule(
        "MB104",
        Severity.NOTE,
        "repeats",
        "Requests to a station that answers, sent again because the first try got no good answer, and the time that "
        "passed from each failed try to the next. A warning from three on, when it is over 2% of the time.",
        "each lost or damaged frame costs the time until it is asked for again",
        "the cause of the losses first; then a shorter timeout, well above the slowest answer",
    ),
    Rule(
        "MB105",
        Severity.NOTE,
        "time spent on absent stations",
        "Share of the time in which the master waited for stations that never answered anything, asked twice or more. "
        "A warning above 5%.",
        "every poll of an absent station costs a timeout, and its repeats too; all others are read less often",
        "take absent stations out of the poll list, or let the master ask them seldom",
    ),
    Rule(
        "MB106",
        Severity.WARNING,
        "answers into what comes next",
        "Damage that stands directly behind waits for one station in vain, behind at least three that did not begin in "
        "noise, and far more often there than in frames of the same senders elsewhere (chance under 1 in 500). An "
        "answer after the master's timeout falls on the next request or on the answer to it, and two senders at once "
        "are no frame. Or damage that begins as its answer where others were asked, or answers that are longer than "
        "they can be and not over when the master's timeout is. Where nearly all damage stands there, but so little "
        "that chance may have put it there, the bus is told of and nobody named.",
        "the station answers when its master has given up; those whose frames are hit are not to blame",
        "raise the master's response timeout, or find out why this station is slow; nobody else's cable",
        explains=(
            *("MB001", "MB002", "MB003", "MB004", "MB005", "MB006", "MB007", "MB009", "MB010", "MB012", "MB019"),
            *("MB101", "MB103", "MB104", "MB105", "MB207", "MB208", *_OF_LINE),
        ),
    ),
    Rule(
        "MB107",
        Severity.WARNING,
        "master gives up too soon",
        "Good answers of two stations or more that come after the master's timeout, three at least; where half of the "
        "stations answer late, have damage directly behind waits for them in vain, or are shown in it, 1 in 3 times "
        "not the same one; and where 3 in 4 damaged frames, if any are, stand where an answer is overdue.",
        "the master's response timeout is shorter than its stations need; late answers fall on what it sends next",
        "raise the master's response timeout above the slowest answer, with room; then look at what is left",
        explains=(
            *("MB002", "MB005", "MB006", "MB007", "MB009", "MB010", "MB012", "MB020", "MB022", "MB101", "MB103"),
            *("MB104", "MB106", "MB201", "MB206", "MB207", "MB208", "MB301", "LN205", "LN303", *_OF_LINE),
        ),
    ),
    Rule(
        "MB201",
        Severity.ERROR,
        "answered twice",
        "A second answer from the same address directly after the first, to a request that was sent once. A single one "
        "is only noted, and so are no more than the station's late answers, or, fewer than 1 in 10 of its answers, no "
        "more than it gave late or not at all. An error only where the two ever differ: the same octets again may also "
        "come from one device or a converter that sends twice.",
        "two stations have the same address, the second one slower",
        "switch the station off and see whether something still answers; give one another address",
        explains=(*_OF_COLLISIONS, "MB301", "MB401"),
    ),
    Rule(
        "MB202",
        Severity.ERROR,
        "two stations seem to have one address",
        "At least three answers from one station, and 1 in 4 of its answers, that begin as they should and go on for "
        "more octets than the answer asked for, by about the same number each time, with a wrong check. Damage makes "
        "no octets more, and noise does not always begin and end alike. Not where two or more answers of others are "
        "talked over, too, and its own no more often than by chance: who does that has no address of theirs.",
        "two stations with this address talk over each other, one a little later",
        "switch the station off and see whether something still answers",
        explains=_OF_COLLISIONS,
    ),
    Rule(
        "MB203",
        Severity.ERROR,
        "two masters",
        "Requests that come while another one waits for a station that is alive, sooner than that station ever answers "
        "(what seems an answer to the second of two masters and is one to the first aside), so that no answer can have "
        "been missed; or the same request twice at once, and an answer to each; or one between another and its answer, "
        "which came no later than answers do. At least three; not where they always come after the same time, as those "
        "of a single master do that never waits, nor where the one between is what comes next, or was asked before, in "
        "the order of one master whose timeout is too short.",
        "two masters on one bus, or a commissioning tool left connected",
        "find the second master; a bus has one, use a gateway or multiplexer for more",
        explains=(*_OF_COLLISIONS, "MB020", "MB002", "MB003", "MB201", "MB202", "MB206", "MB302", "LN205", "LN302"),
    ),
    Rule(
        "MB204",
        Severity.WARNING,
        "answer to a broadcast",
        "A frame within 90 ms after a broadcast, from a station or with address 0; nobody may answer address 0 "
        "(Modbus over Serial Line V1.02, 2.1).",
        "a station with a faulty protocol stack; with several, their answers collide",
        "the frames named; the device's firmware; write to each station separately",
        explains=("MB005", "MB010", "MB301", "MB002", "MB104", "MB207"),
    ),
    Rule(
        "MB205",
        Severity.NOTE,
        "address outside the standard",
        "A good frame to or from address 248 … 255; the standard reserves them (Modbus over Serial Line V1.02, 2.2).",
        "some devices allow them; some masters do not",
        "give the station an address of 1 … 247 if anything else has trouble with it",
    ),
    Rule(
        "MB206",
        Severity.WARNING,
        "answered from another address",
        "Requests to one address that a station with another address answers. At least two, and one for ten answers "
        "of its own: what is rarer answered a request that was lost. A note where the master never repeats such a "
        "request: it takes the answers.",
        "a device that always answers so (some battery systems do), or a wrong address in the master's list",
        "if the master takes these answers, nothing; else the address in its list",
        explains=("MB002", "MB104", "MB207"),
    ),
    Rule(
        "MB207",
        Severity.NOTE,
        "answers that nobody asked for",
        "Answers without a request before them. A warning from three on and 1 in 100 of all answers, without those "
        "directly behind octets that are no frame: these were the request. Where most answers come so, those that do "
        "not fit (MB010, MB206) stand under it.",
        "requests that this tap does not hear, a second bus coupled in, a device that is set to report by itself, or a "
        "maker's own protocol whose requests have the form of answers",
        "whether the tap is at a place where the master is heard well; a setting for automatic reports in the device",
        explains=_OF_ANOTHER_TALKER,
    ),
    Rule(
        "MB208",
        Severity.NOTE,
        "two response times",
        "Good answers to exactly the same request that fall into two groups, each of at least 8 and 1 in 8 of the last "
        "32 … 96, with a gap of 3 ms or more between the longest reading of the quick ones and the shortest of the "
        "slow ones, and that take turns. A warning when something else agrees: second answers, answers with octets "
        "mixed in, or different values in the two groups.",
        "one device that is held up now and then, by a cyclic task, by writing its memory or by a gateway; or two "
        "devices with this address, each of which misses some of the requests",
        "the manual for a second response time; switch the station off and see whether something still answers",
    ),
    Rule(
        "MB301",
        Severity.WARNING,
        "frames too close together",
        "Less than 3.5 characters of silence between two good RTU frames (Modbus over Serial Line V1.02, 2.5.1.1; "
        "1.75 ms above 19200 Bd), even by the longest reading that the adapter leaves. At least three, and 1 in 10 of "
        "the sender's frames (six and two in three where nobody said which adapter it was); not of late answers. "
        "A note about the bus where all its stations, two or more, do so.",
        "strict receivers take the two for one frame and drop both",
        "the response delay of the station, or the pause of the master",
    ),
    Rule(
        "MB302",
        Severity.WARNING,
        "pauses inside frames",
        "More than 1.5 characters of silence inside a good RTU frame (Modbus over Serial Line V1.02, 2.5.1.1), even by "
        "the shortest reading that the adapter leaves, and beyond the even spacing of octets that the sender shows in "
        "most of its frames, or 3.5 characters of it at one place. At least three, and only where the adapter's delay "
        "is at most a fifth of 1.5 characters. Where nobody said which adapter it was, only what is five characters "
        "longer counts, and no place: a UART may hold the last octets back.",
        "a sender that cannot keep its transmitter fed: an interrupted program, a USB adapter, a radio link",
        "strict receivers drop such frames; use a sender with a FIFO or a lower baud rate",
    ),
    Rule(
        "MB303",
        Severity.INFO,
        "gaps cannot be judged with this adapter",
        "Pauses of 1.5 characters inside a frame are judged only where the adapter's delay is at most a fifth of "
        "that; gaps of 3.5 characters between frames only where it is shorter than they are.",
        "that MB301 and MB302 say nothing does not mean that all gaps are as they should be",
        "lower the adapter's latency timer, or use a port of the computer itself",
    ),
    Rule(
        "MB304",
        Severity.NOTE,
        "pauses in everybody's frames",
        "Pauses of over 1.5 characters inside the frames of several senders, of none much more than its part of all "
        "frames explains.",
        "the adapter or the computer hands octets over late, though this capture says nothing of it",
        "the adapter's latency timer; what else the computer does; whether the capture names its adapter",
        explains=("MB302",),
    ),
    Rule(
        "MB401",
        Severity.INFO,
        "poll cycle",
        "Time from one request to the same request again, of the request that was sent most often.",
        "how old a value in the master can be",
        "nothing, if that is fresh enough",
    ),
    Rule(
        "MB402",
        Severity.INFO,
        "addresses searched",
        "At least four addresses that the master asked once, or eight that it asked up to three times beside stations "
        "that it asks three times as often (20 where there are none), and that nobody has.",
        "somebody searched the bus for stations",
        "nothing",
    ),
    Rule(
        "MB403",
        Severity.INFO,
        "answered or repeated",
        "Frames that say the same as the request before them, or have no known layout, and come later than this "
        "station is known to answer: its answer, or the request again. Nothing else on the bus tells which.",
        "a station that takes long to confirm, or one that does not and a master that repeats",
        "the master's timeout and number of repeats: what comes after exactly that time is a repeat",
    ),
)

RULES: dict[str, Rule] = {rule.code: rule for rule in _ALL}
"""The catalogue, by code."""
