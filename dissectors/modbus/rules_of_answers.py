"""The rules of Modbus about answers that fail, MB0xx: part of the catalogue in `rules.py`."""

from __future__ import annotations

from dissectors.findings import Rule, Severity

_OF_DAMAGE = ("MB002", "MB005", "MB007", "MB104", "MB202")
"""What damage that is always the same would otherwise be taken for."""

_OF_LINE = ("LN201", "LN202", "LN203", "LN204")
"""What octets that are no frame would otherwise be taken for."""

RELAYED = "a relay, or a slow echo, that this tap hears beside the master"
"""What MB018 means of the bus."""

ANSWER_RULES = (
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
        "were answered late, nor what stands at the border of a silence that is far longer than any wait of the master "
        "(30 times its pauses, twice the slowest answer, 3 s or more). A single one, or fewer than 1 in 100 and "
        "not surely over two a minute, is only noted, where no quarter of an hour had 52, or ten and 1 in 20.",
        "requests or answers get lost: a loose wire, a missing ground, a station too busy to answer",
        "whether requests or answers are damaged at the same times; the station's terminals and supply",
        explains=("MB104",),
    ),
    Rule(
        "MB003",
        Severity.ERROR,
        "fell silent",
        "A station that used to answer left at least its last five requests without an answer, to the end. A warning "
        "where it was heard again, and nine tenths of all that it left unanswered stand in that row, or in several "
        "with 20 answers for each.",
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
        "last octet damaged",
        "At least three frames of one sender that are right but for their last octet, or end one or two octets early, "
        "and they are most of its damaged ones. In RTU the low octet of the CRC is right and the high one wrong. An "
        "error where all requests are so, since no station can answer.",
        "whoever sends releases its driver before the last octet is out",
        "its turnaround or transmit-delay setting; with a converter, the timer that switches direction",
        explains=("MB001", "MB002", "MB005", "MB007", "MB009", "MB104"),
    ),
    Rule(
        "MB007",
        Severity.WARNING,
        "damage that names no sender",
        "At least three damaged frames, none of whose senders has a greater part in them than its part of all octets "
        "sent explains (95% confidence). Up to four in a row of one sender, with no whole answer between, count as "
        "one: a master repeats into the same disturbance. So a single stretch of damage is nobody's own; where "
        "it fell on one sender alone, nothing tells whether others are struck.",
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
        explains=("MB001", "MB002", "MB003", "MB004", "MB104", "MB105", *("LN203", "LN204", "LN205"), *_OF_DAMAGE),
    ),
    Rule(
        "MB014",
        Severity.ERROR,
        "answers in something else",
        "Octets in place of answers, at least three times and most of what came so: always the same ones, or such that "
        "all runs of equal bits are multiples of 2 … 8, as a slower line looks when it is read too fast; or text; or "
        "octets of one parity, as 7 data bits and a parity bit. "
        "Noise is never the same twice, nor text, and neither are two stations that talk at once.",
        "the device has another baud rate, or speaks another protocol",
        "baud rate, parity and protocol in the device's settings",
        explains=(
            "MB001",
            "MB002",
            "MB003",
            "MB004",
            "MB104",
            "MB105",
            "LN101",
            "LN103",
            "LN201",
            "LN202",
            "LN203",
            "LN204",
            "LN303",
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
        "Protocol V1.1b3, 6.11, 6.12, 6.17); or requests for nothing, for more than the standard allows, beyond the "
        "last address, or of a coil's value that is neither on nor off, answered by exception 2 or 3, by nothing or by "
        "what does not fit. What comes of them is not held against the station. A note about a station that refuses "
        "none of them, and 3 in 4 of whose answers are good frames that contradict themselves as well.",
        "the master builds the request wrongly, and a station can only refuse it; or both speak a maker's own protocol "
        "in frames of Modbus",
        "the address, data type and length of this request in the master's configuration or program",
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
        "a third, and are answered then: a relay, or a slow echo, that this tap hears beside the master. Of a station "
        "also where most of what comes in place of its answers is the request with bits changed to one side.",
        "this station's driver hears itself, or its converter repeats what it hears, before the station answers",
        "how its driver and receiver are enabled; the converter in front of it",
        explains=("MB002", "MB003", "MB004", "MB005", "MB020", "MB104", "MB301", "LN204", "LN205"),
    ),
    Rule(
        "MB019",
        Severity.WARNING,
        "frames do not end with CR LF",
        "ASCII frames that are whole and end with CR alone, LF alone, LF CR or CR CR LF (Modbus over Serial Line V1.02"
        ", 2.5.2): at least three, and 1 in 10 of the sender's. Those with CR in its place are read as good; who waits "
        "for CR finds no end in the others, which are damaged here, too. A note where everybody on the bus ends so; an "
        "error where the requests do and nobody answers.",
        "a driver that is released before the last octet is out, or a device that ends its frames with CR alone; "
        "others may wait for the LF and drop the frame",
        "its turnaround or transmit-delay setting, a converter's timer for the direction; its end character",
        explains=(
            "MB001",
            "MB104",
            "MB105",
            "MB009",
            "MB022",
            "LN003",
            "LN202",
            "LN203",
            "LN204",
            "LN207",
            *_OF_DAMAGE,
        ),
    ),
    Rule(
        "MB020",
        Severity.WARNING,
        "answers not heard here",
        "Requests that nothing followed here, after which the master went on as it does after an answer: no later than "
        "answers and its usual pauses take, and, four times in five, without asking again. Or, then an error, requests "
        "to two stations or more of which none is ever heard and none is asked again. Not where the master sends by "
        "the clock, however long answers take.",
        "answers that this tap does not hear: a signal too weak here, a four-wire line of which this pair carries the "
        "master alone, reads that the recording lost; or stations that are off, and a master that sends by the clock",
        "whether the master has their values; tap near those stations, and on both pairs of a four-wire line",
        explains=("MB002", "MB105", "MB207"),
    ),
    Rule(
        "MB021",
        Severity.WARNING,
        "check always wrong",
        "A station or a master of which hardly a good frame was heard, and frames without a line error whose check "
        "alone is wrong: at least five, and 3 in 4 of the damaged ones, differ from the right one in the same bits as "
        "others of their length that say something else, or as a check does that begins with 0; or are made by another "
        "rule each time (an LRC that is not negated, or of the characters; a CRC in its place; all zeros or ones; left "
        "out). Noise changes other bits each time. An error where no request is good: no station can answer.",
        "the device computes its check otherwise: another start value or polynomial, or over other octets",
        "the device's firmware; whether a converter on the way changes octets",
        explains=("MB001", "MB009", "MB104", "LN003", *_OF_DAMAGE),
    ),
    Rule(
        "MB022",
        Severity.WARNING,
        "requests damaged here alone",
        "Requests that arrive damaged at this tap and are answered all the same, more of them than of those that are "
        "not answered. A note where there are few, or answers are damaged as well. Under it stands what a station "
        "leaves unanswered (MB002), where that is no more.",
        "noise at this tap, or a signal of the master too weak here; where it was heard worse still, the answers seem "
        "to come unasked",
        "this tap's place, its ground and its wires to the line; whether the master's reads fail at all",
        explains=("MB207", "LN101"),
    ),
    Rule(
        "MB023",
        Severity.WARNING,
        "octets taken for text",
        "Damaged frames of which at least three, and 3 in 4 of the newest ones that tell it, are good once one thing "
        "is undone that ports and programs do to text: CR (0D) read as LF (0A), or LF as CR; CR put before LF; CR, LF "
        "or FF left out; XON and XOFF (11, 13) left out; FF sent twice. By chance once in 16 million. Of the bus where "
        "it befalls several, or all there are.",
        "the port or the program that this was read with takes octets for text: a terminal's line discipline, text "
        "mode, software flow control, Telnet, a gateway that translates line ends; the line may be well",
        "read the port raw (binary), without XON/XOFF and line-end translation; does the master have the same trouble",
        explains=(
            *("MB001", "MB006", "MB009", "MB010", "MB012", "MB015", "MB022", "MB106", "MB207", "MB208", "LN003"),
            *_OF_LINE,
            *_OF_DAMAGE,
        ),
    ),
    Rule(
        "MB024",
        Severity.WARNING,
        "answers carried over to the next read",
        "Answers that begin behind one request and end behind another, with a good check when their pieces are put "
        "together: at least two, and half of all damaged answers. Each check agrees by chance once in 65536.",
        "the program whose reads these are takes fewer octets than come, and finds the rest at its next read; the line "
        "may be well",
        "how many octets it reads, whether others come before the answer (an echo, a preamble), and whether it empties "
        "its buffer before it asks",
        explains=("MB003", "MB006", "MB009", "MB010", "MB012", "MB015", "MB207", *_OF_LINE, *_OF_DAMAGE),
    ),
)
"""In the order of their codes."""
