"""The rules of Modbus: what each measures, against which limit, what it means and what to check next.

MB0xx answers that fail, MB1xx time, MB2xx addresses and masters, MB3xx gaps between octets and frames, MB4xx facts.
"""

from __future__ import annotations

from dissectors.findings import Rule, Severity

_OF_LINE = ("LN101", "LN103", "LN201", "LN202", "LN203", "LN204")

_OF_COLLISIONS = (
    *("MB005", "MB007", "MB008", "MB009", "MB010", "MB103", "MB104", "MB106", "MB207", "MB208"),
    *_OF_LINE,
)
"""What two senders at once make of good frames."""

_OF_ANOTHER_TALKER = ("MB005", "MB007", "MB009", "MB104", "LN101", "LN103")
"""The damage that answers which nobody asked for do to frames that they fall on."""

_OF_DAMAGE = ("MB002", "MB005", "MB007", "MB104", "MB202")
"""What damage that is always the same would otherwise be taken for."""

_ALL = (
    Rule(
        "MB001",
        Severity.ERROR,
        "no answer",
        "Requests to a station of which no good frame was ever heard here, at most 1 in 4 of them followed by octets "
        "that are no frame. Where it was asked only once, repeats not counted, it is only noted.",
        "no station at this address: off, set to another address or baud rate, cut off, or not heard by this tap",
        "whether the master has its values, which tells that it answers; else its supply, address switch and baud rate",
        explains=("MB105", "MB104"),
    ),
    Rule(
        "MB002",
        Severity.WARNING,
        "some requests without answer",
        "Requests that no octet followed before the master went on, to a station that answers others; not those that "
        "were answered late. A single one, or "
        "fewer than 1 in 100 and not surely over two a minute, is only noted.",
        "requests or answers get lost: a loose wire, a missing ground, a station too busy to answer",
        "whether requests or answers are damaged at the same times; the station's terminals and supply",
        explains=("MB104",),
    ),
    Rule(
        "MB003",
        Severity.ERROR,
        "fell silent",
        "A station that used to answer left at least its last five requests without an answer, to the end.",
        "the station was switched off, crashed or lost its connection at that time",
        "what happened at the time of the last answer; supply, fuse and connector of the station",
        explains=("MB002", "MB104", "MB105"),
    ),
    Rule(
        "MB004",
        Severity.WARNING,
        "one request without answer",
        "A station answers other requests but never this one (function and first register), asked three times or more.",
        "the station drops what it does not support instead of answering with an exception",
        "the device's register map; take the request out of the master's list",
        explains=("MB002", "MB104"),
    ),
    Rule(
        "MB005",
        Severity.WARNING,
        "damaged answers",
        "Answers with a wrong check or length, or octets in place of an answer that are no frame. Counted at the "
        "station that was asked. A single one, or fewer than 1 in 100 and not surely over two a minute, is only noted.",
        "noise on this station's drop: a long stub, a bad connector, its driver",
        "termination and bias; this station's connector and stub; its distance from power cables",
        explains=("MB002", "MB104"),
    ),
    Rule(
        "MB006",
        Severity.WARNING,
        "last octet of answers damaged",
        "At least three answers of a station that are right but for their last octet, or end one octet early, and they "
        "are most of its damaged answers. In RTU the low octet of the CRC is right and the high one wrong.",
        "the station releases its driver before the last octet is out",
        "its turnaround or transmit-delay setting; with a converter, the timer that switches direction",
        explains=("MB002", "MB005", "MB007", "MB104"),
    ),
    Rule(
        "MB007",
        Severity.WARNING,
        "damage whoever sends",
        "At least three damaged frames, none of whose senders has a greater part in them than its part of all octets "
        "sent explains (95% confidence). Up to four in a row of one sender, with no whole answer between, count as "
        "one: a master repeats into the same disturbance. So a single stretch of damage is nobody's own.",
        "a cause common to all: termination, bias, ground, cable, or noise near the master",
        "120 Ω at both ends only, one bias, the shield grounded once; then halve the line to find the place",
        explains=("MB002", "MB005", "MB009", "MB104"),
    ),
    Rule(
        "MB008",
        Severity.WARNING,
        "exception",
        "A station answers with an exception code. Codes 1 … 11 have the meanings of Modbus Application Protocol "
        "V1.1b3, clause 7; others are the vendor's. Where the profile of the device words a code, those words count. "
        "Only a note where codes 1 … 3 answer what is tried once for eight times that something is polled.",
        "the station heard the request well and refuses it; the code says why",
        "the code, the register and the count, against the device's manual",
    ),
    Rule(
        "MB009",
        Severity.WARNING,
        "damaged requests",
        "Requests that arrive damaged at this tap. A station ignores such a request, so it also goes unanswered.",
        "noise near the master or the tap, a second master, or a driver of the master that switches too late",
        "the master's connection, termination there, and whether a second master is on the bus",
        explains=("MB104",),
    ),
    Rule(
        "MB010",
        Severity.WARNING,
        "answer does not fit the request",
        "A good frame in answer whose function, count, address or copy is not what was asked for; or requests that are "
        "given back whole in place of their answer.",
        "a device that does something else than it was asked for, or answers an earlier request",
        "the frames named; the device's manual and firmware",
    ),
    Rule(
        "MB011",
        Severity.WARNING,
        "check octets swapped",
        "Answers whose check is right once its two octets change places: at least three, and most of the station's "
        "damaged answers. RTU sends the low octet of the CRC first (Modbus over Serial Line V1.02, 2.5.1.2). An error "
        "of the master where all its requests are so: nobody answers them.",
        "the device sends its check the wrong way round; what it says is sound",
        "the device's firmware; a master that is told to take the check so can read it",
        explains=("MB009", "LN003", *_OF_DAMAGE),
    ),
    Rule(
        "MB012",
        Severity.WARNING,
        "first octet lost",
        "Frames that are good once their first octet, the address, is put there or put right: at least three, and most "
        "of the sender's damaged frames. Of the master where it is all stations that answer so soon, at least three.",
        "the sender switches its driver on too late, or a receiver or repeater is not ready when a frame begins",
        "the time that its driver is on before it sends; bias that keeps the line at rest; a converter on the way",
        explains=_OF_DAMAGE,
    ),
    Rule(
        "MB013",
        Severity.ERROR,
        "echo cut short",
        "Octets directly after a request that are the begin of the same request, and not all of it: at least three, "
        "after every second request. No station can answer so.",
        "the adapter gives back what it sends, and the program that wrote this capture stopped reading too soon: it "
        "waited for as many octets as the answer has; the answer itself may have come and was not read",
        "switch the adapter's echo off, or let the program read its echo away before the answer",
        explains=("MB001", "MB002", "MB003", "MB004", "MB104", "MB105", "LN205", *_OF_DAMAGE),
    ),
    Rule(
        "MB014",
        Severity.ERROR,
        "answers in something else",
        "Octets in place of answers, at least three times and most of what came so: always the same ones, or such that "
        "all runs of equal bits are multiples of 2 … 8, as a slower line looks when it is read too fast. Noise is "
        "never the same twice, and neither are two stations that talk at once.",
        "the device has another baud rate, or speaks another protocol",
        "baud rate, parity and protocol in the device's settings",
        explains=(
            "MB001",
            "MB002",
            "MB003",
            "MB004",
            "MB104",
            "MB105",
            "LN201",
            "LN202",
            "LN203",
            "LN204",
            *_OF_DAMAGE,
        ),
    ),
    Rule(
        "MB015",
        Severity.WARNING,
        "always the same damaged answer",
        "Damaged answers that are octet for octet the same, at least three and 3 in 4 of those that came.",
        "no noise, which is never the same twice: the device makes its check or its length wrongly",
        "the device's firmware; whether a converter on the way changes octets (XON, XOFF, line ends)",
        explains=_OF_DAMAGE,
    ),
    Rule(
        "MB016",
        Severity.WARNING,
        "requests that contradict themselves",
        "Good frames to functions 15, 16 or 23 whose byte count is not what their quantity takes (Modbus Application "
        "Protocol V1.1b3, 6.11, 6.12, 6.17). Exceptions in answer to them are not held against the station.",
        "the master builds the request wrongly; a station can only refuse it",
        "the data type and length of this write in the master's configuration or program",
    ),
    Rule(
        "MB017",
        Severity.WARNING,
        "reads of address 0",
        "Requests to address 0 that ask for an answer. Address 0 is for broadcasts, which only write and which nobody "
        "answers (Modbus over Serial Line V1.02, 2.1); some devices answer all the same.",
        "the unit number is not set in the master",
        "the unit number of this device in the master's configuration",
        explains=("MB204", "MB206", "MB207", "MB005", "MB104", "MB105"),
    ),
    Rule(
        "MB018",
        Severity.WARNING,
        "request copied back",
        "Nine in ten requests to one station come back at once, and those to others never. Of the bus: nine in ten "
        "requests, to two stations or more, come a second time, always as long after the first, within 150 ms, never "
        "a third, and are answered then.",
        "this station's driver hears itself, or its converter repeats what it hears, before the station answers; where "
        "all requests come twice, a relay or a slow echo that this tap hears beside the master",
        "how its driver and receiver are enabled; the converter in front of it; which radio or repeater is on the way",
        explains=("MB002", "MB003", "MB004", "MB005", "MB020", "MB104", "MB301", "LN205"),
    ),
    Rule(
        "MB019",
        Severity.WARNING,
        "frames end without line feed",
        "ASCII frames that end with CR, and nothing where LF should be (Modbus over Serial Line V1.02, 2.5.2): at "
        "least three, and 1 in 10 of the sender's. They are read as good. A note where everybody on the bus ends so.",
        "a driver that is released before the last octet is out, or a device that ends its frames with CR alone; "
        "others may wait for the LF and drop the frame",
        "its turnaround or transmit-delay setting, a converter's timer for the direction; its end character",
        explains=("MB104",),
    ),
    Rule(
        "MB020",
        Severity.WARNING,
        "answers not heard here",
        "Requests that nothing followed here, after which the master went on as it does after an answer: no later than "
        "answers and its usual pauses take, and, four times in five, without asking again. Or, then an error, requests "
        "to two stations or more of which none is ever heard and none is asked again.",
        "answers that this tap does not hear: a signal too weak here, a four-wire line of which this pair carries the "
        "master alone, reads that the recording lost; or stations that are off, and a master that sends by the clock",
        "whether the master has their values; tap near those stations, and on both pairs of a four-wire line",
        explains=("MB002", "MB105", "MB207"),
    ),
    Rule(
        "MB021",
        Severity.WARNING,
        "check always wrong",
        "A station of which no good answer was heard, and answers without a line error whose check alone is wrong: at "
        "least five, and 3 in 4 of the damaged ones, differ from the right one in the same bits as others of their "
        "length that say something else, or as a check does that begins with 0. Noise changes other bits each time.",
        "the device computes its check otherwise: another start value or polynomial, or over other octets",
        "the device's firmware; whether a converter on the way changes octets",
        explains=("MB001", *_OF_DAMAGE),
    ),
    Rule(
        "MB022",
        Severity.WARNING,
        "requests damaged here alone",
        "Requests that arrive damaged at this tap and are answered all the same, more of them than of those that are "
        "not answered. A note where there are few, or answers are damaged as well.",
        "noise at this tap, or a signal of the master too weak here; where it was heard worse still, the answers seem "
        "to come unasked",
        "this tap's place, its ground and its wires to the line; whether the master's reads fail at all",
        explains=("MB207", "LN101"),
    ),
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
        explains=("MB101", "MB104", "MB201", "MB301", "MB005", "MB010", *_OF_LINE),
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
        "Damage that stands directly behind waits for one station in vain, at least three times, and far more often "
        "there than in frames of the same senders elsewhere (chance under 1 in 500). An answer after the master's "
        "timeout falls on the next request or on the answer to it, and two senders at once are no frame. Or damage "
        "that begins as its answer where others were asked, or answers that are longer than they can be and not over "
        "when the master's timeout is.",
        "the station answers when its master has given up; those whose frames are hit are not to blame",
        "raise the master's response timeout, or find out why this station is slow; nobody else's cable",
        explains=(
            *("MB001", "MB002", "MB003", "MB004", "MB005", "MB007", "MB009", "MB010", "MB019", "MB103", "MB104"),
            *("MB105", "MB207", *_OF_LINE),
        ),
    ),
    Rule(
        "MB201",
        Severity.ERROR,
        "answered twice",
        "A second answer from the same address directly after the first, to a request that was sent once. A single one "
        "is only noted, and so are no more than the station's late answers. An error only where the two ever differ: "
        "the same octets again may also come from one device or a converter that sends twice.",
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
        "no octets more, and noise does not always begin and end alike.",
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
        "which came no later than answers do. At least three; not where "
        "they always come after the same time, as those of a single master do that never waits.",
        "two masters on one bus, or a commissioning tool left connected",
        "find the second master; a bus has one, use a gateway or multiplexer for more",
        explains=(*_OF_COLLISIONS, "MB020", "MB002", "MB003", "MB201", "MB202", "MB302"),
    ),
    Rule(
        "MB204",
        Severity.WARNING,
        "answer to a broadcast",
        "A frame within 90 ms after a broadcast, from a station or with address 0; nobody may answer address 0 "
        "(Modbus over Serial Line V1.02, 2.1).",
        "a station with a faulty protocol stack; with several, their answers collide",
        "the frames named; the device's firmware; write to each station separately",
        explains=("MB005", "MB010", "MB301", "MB002", "MB104"),
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
        "Requests to one address that a station with another address answers. At least two. A note where the master "
        "never repeats such a request: it takes the answers.",
        "a device that always answers so (some battery systems do), or a wrong address in the master's list",
        "if the master takes these answers, nothing; else the address in its list",
        explains=("MB002", "MB104", "MB207"),
    ),
    Rule(
        "MB207",
        Severity.NOTE,
        "answers that nobody asked for",
        "Answers without a request before them. A warning from three on and 1 in 100 of all answers.",
        "requests that this tap does not hear, or a second bus coupled in",
        "whether the tap is at a place where the master is heard well",
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
        "the sender's frames; not of answers that came too late.",
        "strict receivers take the two for one frame and drop both",
        "the response delay of the station, or the pause of the master",
    ),
    Rule(
        "MB302",
        Severity.WARNING,
        "pauses inside frames",
        "More than 1.5 characters of silence inside a good RTU frame (Modbus over Serial Line V1.02, 2.5.1.1), even by "
        "the shortest reading that the adapter leaves, and beyond the even spacing of octets that the sender shows in "
        "most of its frames. At least three, and only where the adapter's delay is at most a fifth of 1.5 characters.",
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

EXCEPTIONS: dict[int, tuple[Severity, str, str]] = {
    1: (
        Severity.WARNING,
        "the device does not have this function",
        "the functions in its manual; take the request out of the master's list",
    ),
    2: (
        Severity.WARNING,
        "a register that the device does not have, or a block that runs over the end of its map",
        "the first register and the count; maps in manuals often count from 1, the wire from 0",
    ),
    3: (
        Severity.WARNING,
        "a value or count that the device does not accept",
        "the value written, or the number of registers asked for at once",
    ),
    4: (Severity.ERROR, "the device failed while it did what was asked", "the device's fault memory"),
    5: (Severity.NOTE, "the device takes long for this and will finish later", "whether the master asks again later"),
    6: (Severity.NOTE, "the device is busy", "how often; let the master ask less often"),
    8: (Severity.ERROR, "the device found its memory damaged", "replace the device's memory or the device"),
    10: (Severity.WARNING, "a gateway has no path to the target", "the gateway's routes and port settings"),
    11: (Severity.WARNING, "the device behind a gateway does not answer", "that device: supply, address, wiring"),
}
"""Exception code → severity, what it is consistent with, what to check next."""

USED_ALIKE = (1, 2, 3, 6)
"""Codes of the standard that makers use as the standard does, whatever they call them."""

MAKER_EXCEPTION = (
    Severity.WARNING,
    "the device refuses the request, for the reason that its maker gives for this code",
    "the request against the device's manual: register, count, value, and whether it takes writes now",
)
"""The same for a code that the profile of the device words: the maker may use codes of the standard otherwise."""

VENDOR_EXCEPTION = (
    Severity.WARNING,
    "a refusal with a code of the vendor's own",
    "the code in the device's manual",
)
