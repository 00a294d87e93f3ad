"""The rules of the line itself, whatever protocol runs on it: what each measures, what it means, what to check next.

LN0xx what this capture can tell, LN1xx octets that arrive wrong, LN2xx octets that nobody should have sent, LN3xx
patterns in time, LN4xx who uses the line.
Where noise lies tells its cause; the table behind it was collected from reports of users and is worded as
"consistent with", never as proof.
"""

from __future__ import annotations

from dissectors.findings import Rule, Severity

_WIRING = "termination at both ends and nowhere else, one fail-safe bias, A and B, ground"

_DAMAGE = (
    "LN1",
    "LN2",
    "MB002",
    "MB005",
    "MB006",
    "MB007",
    "MB009",
    "MB104",
    "MB207",
    "MB401",
    "N2004",
    "N2005",
    "N2010",
    "MS4",
    "PB002",
    "PB003",
    "PB007",
    "PB008",
    "PB013",
    "PB014",
)
"""What damage to frames is told by, in every protocol."""

_DAMAGED = (
    *("MB005", "MB006", "MB007", "MB009", "MB011", "MB012", "MB015", "MB021"),
    *("N2004", "MS401", "MS402", "PB008"),
)
"""What tells of damaged frames whose they are, and so tells of their line errors and remains."""

_ALL = (
    Rule(
        "LN001",
        Severity.INFO,
        "what this capture can tell",
        "Which line errors the adapter reports, and how long it may hold an octet back. No report is no proof of a "
        "clean line where the adapter cannot report.",
        "rules that need more than that stay silent",
        "for exact times and line errors use a port of the computer itself, or an adapter with a 1 ms latency timer",
    ),
    Rule(
        "LN002",
        Severity.WARNING,
        "nothing heard",
        "Not one octet in the whole capture.",
        "a silent bus, an adapter on the wrong pair, or A and B swapped on an adapter that then sees a steady break",
        "whether the master runs; the two wires; the ground; then listen longer",
    ),
    Rule(
        "LN003",
        Severity.ERROR,
        "hardly anything is a frame",
        "Under 3 in 10 octets, and under 3 in 10 of all frames and other stretches, are good frames; of at least 60 "
        "octets, or 40 where it is known what they are. Frames that are good but for one thing, the same three times "
        "or more, count as good: the rules of the protocol name it. Not where 20 frames or more are good, "
        "with 1 in 10 octets in them: they prove the settings (LN204). Also where none of many different frames has an "
        "octet above 7F, and 1 in 10 is damaged: those are good that never had one. All other rules are left out then: "
        "they would judge rubbish. What fits is named: another protocol whose checks agree, frames of a network, "
        "seven bits read as eight, data bits that the port lacks, inverted octets, a bus that is slower (every level "
        "lasts a multiple of so many bits) or faster (the same few octets again and again, too few for a frame).",
        "wrong baud rate, wrong parity, wrong protocol, or A and B swapped",
        "the settings of the line (-s) and the protocol (-p); then A and B",
    ),
    Rule(
        "LN004",
        Severity.ERROR,
        "parity set differently from the bus",
        "Over 1 in 10 octets of good frames with a parity or framing error (1 in 2 where one flag covers a whole "
        "packet), whoever sends (a sender that is struck far more than the others aside), while at least 8 in 10 "
        "octets are in good frames. Octets that are no frame do not count: those are somebody else's. Or 1 octet in 5 "
        "with such an error, exactly those that another parity explains, and without them they read as good frames.",
        "the port listens with another parity than the bus has; frames get through by their check alone",
        "the parity of the bus (8E1, 8O1, 8N1, 8N2), and set it with -s",
        explains=("PB008", "LN103", "LN204"),
    ),
    Rule(
        "LN005",
        Severity.WARNING,
        "octets missing from the capture",
        "Octets that were on the bus and are not in the capture: the computer did not keep up, the file is damaged, or "
        "a part of a recording was not given. What follows such a hole looks like faults of the bus and is not.",
        "a computer that is too busy, a full disk, a damaged file, or a part left out",
        "what else runs on the computer; real-time priority for the capture; whether no part was left out",
    ),
    Rule(
        "LN006",
        Severity.WARNING,
        "adapter unplugged",
        "The serial adapter went away and, mostly, came back; or it was not there when the capture began.",
        "a loose plug, a hub without enough power, disturbance on the USB cable, or another name of the port",
        "another cable or port, a powered hub, an isolated adapter",
    ),
    Rule(
        "LN007",
        Severity.NOTE,
        "clock stepped",
        "The wall clock of the computer was set against its monotonic clock. Intervals are not affected; in files of "
        "other programs, whose times run back or ahead there, the one at the step is not known and told as short.",
        "time synchronisation after a start without network; in a log of local time, summer time that begins or ends",
        "nothing; only compare wall times across the step with care",
    ),
    Rule(
        "LN101",
        Severity.WARNING,
        "parity or framing errors",
        "Octets of frames that the adapter marked, counted at the station that sent the frame (a master's frames at "
        "the master). A single one, or fewer than 1 frame in 100 and not surely over two a minute, is only noted. "
        "A sender is named that is struck clearly more often than the octets that it sends explain (2.5 times the "
        "rate of the other stations, by chance less than once in a thousand; where nobody else is struck, in twenty), "
        "repeats into one disturbance counted once; else one finding names the bus. Where one flag covers a whole "
        "packet (the adapter says so, or in a capture that does not name it the marks: they go on in long runs through "
        "good frames), damaged frames count, and packets with a flag: a station is named that is in nearly all of them "
        "while the others are mostly in packets without one.",
        "noise while this station sends, weak levels from it, or two that send at once",
        "this station's connector, stub and ground; " + _WIRING,
        told_by=_DAMAGED,
    ),
    Rule(
        "LN102",
        Severity.WARNING,
        "line errors without a place",
        "Errors that the driver counted without saying at which octet.",
        "noise, or a wrong parity setting",
        _WIRING,
    ),
    Rule(
        "LN103",
        Severity.WARNING,
        "breaks",
        "The line was held low for longer than a character. Counted are disturbances: all within 250 ms of the first "
        "are one. One, all within one second, or few (as in LN101) are only noted. Where at least four, and 8 in 10 "
        "of them, begin in or directly after the frames of one station, far more than its share, and hold the line "
        "low three times at most, that station is named: longer ones are somebody's talk, behind it by time alone. No "
        "break is a zero octet among others that are no frame, or in a good frame: so sounds another baud rate or "
        "format.",
        "no fail-safe bias while nobody drives the line, A and B swapped at one device, or a short circuit",
        "bias resistors at one place of the line; A and B of devices added last",
        told_by=_DAMAGED,
    ),
    Rule(
        "LN104",
        Severity.WARNING,
        "octets lost in the adapter",
        "The adapter reported overruns: octets came faster than they were fetched from it. A note where most of what "
        "is damaged is so without an overrun.",
        "an adapter or computer that is too slow for this baud rate; the bus itself may be in order",
        "another adapter; fewer programs on the computer; a UART with a FIFO",
        explains=(*_DAMAGE, "MB003"),
    ),
    Rule(
        "LN201",
        Severity.WARNING,
        "stray octets before frames",
        "One to three octets that are no frame directly before a frame, counted at the station that sent the frame. A "
        "single one, or fewer than 1 frame in 100 and not surely over two a minute, is only noted. A sender is "
        "named that has clearly more of them than its share of the frames; what falls before everybody's frames is the "
        "bus's, told once, and what falls anywhere is LN203.",
        "the driver is switched on too late or the line floats until then; weak bias",
        "the turnaround of that station; bias; its converter's direction control",
        explains=("LN204",),
    ),
    Rule(
        "LN202",
        Severity.WARNING,
        "stray octets after frames",
        "One to three octets that are no frame directly after a frame, counted at the station that sent the frame; "
        "limits as in LN201.",
        "the driver lets go too late or the line falls when it does; weak bias",
        "bias; the turnaround of that station; its converter's direction control",
        explains=("LN204",),
    ),
    Rule(
        "LN203",
        Severity.WARNING,
        "stray octets in silence",
        "One to three octets that are no frame, with silence on both sides, or anywhere, whoever sends before or "
        "after. A single one, or fewer than 1 to 100 frames and not surely over two a minute, is only noted; so is "
        "what comes in place of the answers of one station, at that station.",
        "the line floats when nobody drives it: no or weak fail-safe bias; or noise coupled in",
        "bias at one place of the line; the cable's way along power lines and motors",
        explains=("LN204",),
    ),
    Rule(
        "LN204",
        Severity.WARNING,
        "octets that are no frame",
        "Stretches of four octets or more that are no frame, and what follows a damaged frame: 1 in 50 octets or more "
        "of all. A smaller share is only noted. Said is where they are another protocol's frames with good checks, "
        "or a network's, where they are always the same, and where they were sent with a slower baud rate. Where "
        "nearly all come in place of the answers of one station that is not heard otherwise, it is told of that "
        "station.",
        "damaged frames beyond recognition, another protocol on the same line, or a device with another baud rate",
        "what the stretches have in common: their place, time and first octets",
        told_by=_DAMAGED,
    ),
    Rule(
        "LN205",
        Severity.NOTE,
        "echo",
        "An exact copy of a request, or of an answer, directly behind it. What gives back all that it hears does so "
        "with nearly every one: a warning from three on, and half of the requests.",
        "a repeater or converter that gives back what it hears, or an adapter that hears itself",
        "the echo setting of the master's adapter or of the converter; it halves the time left on the bus",
        explains=("N2011", "N2013", "MS102", "PB018", "LN204"),
    ),
    Rule(
        "LN206",
        Severity.WARNING,
        "frames in pieces",
        "Two or three rows, each of four octets or more, that are no good frame, and put together are one whose check "
        "agrees: a pause tore it. From three on and 1 in 20 of its frames, clearly more than its share, the "
        "sender is named; else it is only noted.",
        "a link that delivers this sender's frames in pieces (a radio, a modem, a gateway), or firmware that pauses",
        "the packet size and delay of the link, the firmware; whether whoever reads by silence takes such frames",
        explains=("LN204", "LN301", "LN302", "LN303", "MB005", "MB007", "MB009", "N2004", "MS401", "MS402"),
    ),
    Rule(
        "LN207",
        Severity.WARNING,
        "octets put behind frames",
        "The same octets, three at most, directly behind 9 in 10 frames of one sender, at least five: two or more, or "
        "one that no change of the level makes. Those of a master are only noted where stations answer all the same, "
        "and an error where no station is heard.",
        "the program that sends adds them (a line end as of a terminal, a check over a frame and its check, which is "
        "00 00), or a converter on the way; of octets like 00 and FF it may be the driver that lets go late",
        "that program: frames as they are, without a line end, the check once; the converter",
        explains=("LN204", "MB001", "MB002", "MB004", "MB020", "MB104", "MB105"),
    ),
    Rule(
        "LN301",
        Severity.WARNING,
        "disturbances in step with the mains",
        "Marked octets, stray octets and short damaged frames that follow one another at whole waves or half waves of "
        "50 or 60 Hz: at least 15 within 2 s of each other, seven tenths locked to it, by chance less than once in a "
        "million, while the undisturbed frames are not in step with it, whoever sends, and at many intervals. "
        "Times must be known to a sixth of a wave.",
        "hum: a mains cable beside the bus, a missing or twofold ground, a dimmer, a drive or a supply that couples in",
        "the cable's way beside mains cables; the shield, grounded at one end; the ground between far stations; "
        "supplies and drives, one switched off after the other",
        explains=_DAMAGE,
    ),
    Rule(
        "LN302",
        Severity.WARNING,
        "disturbances at a steady interval",
        "At least six bursts of damage or noise with 8% between their intervals, a second or more apart, that strike "
        "several senders, or of which nobody is known and that are noise (with line errors, no two alike), with good "
        "frames between: no single station's rhythm, and none at which anything is sent on this bus, nor at which it "
        "begins to speak after a silence.",
        "something that switches at that interval: a contactor, a pump, a heater, a compressor, a thermostat",
        "what in the plant switches at that interval, and its cable beside the bus; a suppressor at its coil",
        explains=_DAMAGE,
    ),
    Rule(
        "LN303",
        Severity.WARNING,
        "unreadable for a while",
        "At least 40 octets without one good frame, while there are good frames before or after, and the octets are no "
        "noise: other settings fit them, or a third of them have line errors.",
        "for a while somebody spoke with another baud rate, format or protocol: a device that searches for the rate, a "
        "service tool, a gateway that starts",
        "what was switched on or configured at that time",
        explains=_DAMAGE,
    ),
    Rule(
        "LN304",
        Severity.WARNING,
        "silent for a while",
        "Not one octet for 3 s or more (10 s behind a request) and 30 times as long as all but 2 in 100 pauses, in the "
        "middle of traffic that goes on as before; not where such pauses are regular, or more than eight and over two "
        "an hour or 10% of the time, and not where octets were lost or the adapter was away. Of a bus that is listened "
        "to it is told also while it lasts: from a minute on, where "
        "that is twice as long as any silence before.",
        "the master stopped: a restart, a busy controller, a changeover, a program that was loaded",
        "the master's log and watchdog at that time",
        explains=("MS101",),
    ),
    Rule(
        "LN305",
        Severity.ERROR,
        "several stations lost at one moment",
        "Two stations or more that had answered, and then left three requests in a row without answer, all from the "
        "same moment on as far as their polls tell, within so small a part of the capture that chance would put so "
        "many there less than once in ten; or that answered nothing at first, for ten seconds, and then all from one "
        "such moment on. A warning where they came back, unless it was so three times and more.",
        "something they share: a supply, a fuse, a stretch of cable, a repeater",
        "what these stations have in common: supply, cabinet, the piece of cable behind the last one that answers",
        explains=(
            "MB001",
            "MB002",
            "MB003",
            "MB020",
            "MB104",
            "MB105",
            "N2005",
            "N2010",
            "N2015",
            "PB001",
            "PB002",
            "PB007",
        ),
    ),
    Rule(
        "LN401",
        Severity.NOTE,
        "bus near its limit",
        "Octets on the line in over 80% of 10 s; a warning over 92% of 30 s, unless nobody said the baud rate, or "
        "more octets came than it can carry. The gaps that a protocol needs between its frames come on top of that.",
        "more is asked than the line can carry, or it waits for nobody: a lost frame costs the next ones their turn",
        "poll less often, read whole blocks, a higher baud rate, or another line for some of the stations",
    ),
    Rule(
        "LN402",
        Severity.NOTE,
        "many broadcasts",
        "At least 30 broadcasts that make up 1 in 5 of all octets and 3 in 100 of all time; a warning where it is 2 in "
        "5 of all octets (but not nearly all: a bus that is made for broadcasts) and 15 in 100 of all time. Every "
        "station must listen to each of them.",
        "a device or a tool that looks for others again and again, or a gateway that lets all broadcasts through",
        "who sends them (`show` with their frames) and why; what the gateway lets through",
    ),
)

LINE_RULES: dict[str, Rule] = {rule.code: rule for rule in _ALL}
"""The catalogue, by code."""
