"""The rules of MS/TP: what each finds, against which limit, and what to check next. MS1 token, MS2 polls, MS3 answers,
MS4 octets and frames, MS5 addresses, MS6 who uses the line, MS7 content (`content_findings.py`).
"""

from __future__ import annotations

from dissectors.bacnet.content_findings import CONTENT_RULES
from dissectors.bacnet.long_answers import LENGTH_RULES
from dissectors.bacnet.rules_of_answers import ANSWER_RULES
from dissectors.bacnet.rules_of_polls import POLL_RULES
from dissectors.bacnet.told_times import TIME_RULES
from dissectors.findings import Rule, Severity

_WIRING = "termination and bias at both ends, the shield, and the line's length and stubs"

_ALL = (
    Rule(
        "MS101",
        Severity.ERROR,
        "lost token, or silence",
        "Nothing was sent for 500 ms (Tno_token) and then a station began anew: the token was lost "
        "(ASHRAE 135, 9.5.6). It looks for a successor then: where the ring goes on with anything else, no token was "
        "lost. The one with the lowest address begins first, 10 ms (Tslot) per address later, so that a silence of "
        "twice that time is of all stations together. Nobody is named for either. Only where tokens are in the "
        "capture.",
        "the station that had the token was reset, switched off or disturbed while it passed the token on",
        "power and wiring of the last holder; noise at that moment; whether it answers Test Request",
        explains=("MS102", "MS105", "MS106", "MS201"),
    ),
    Rule(
        "MS102",
        Severity.WARNING,
        "token repeated",
        "A station sent the same token again because nobody used it within 20 … 35 ms (Tusage_timeout); "
        "Nretry_token is 1.",
        "the next station is deaf, slow, gone, or shares its address with another",
        "the receiving station: wiring, baud rate, load, duplicate address",
    ),
    Rule(
        "MS103",
        Severity.WARNING,
        "slow to use the token",
        "A station began to send later than 15 ms (Tusage_delay) after the token reached it, by the smallest reading "
        "of the time (3 ms later, where nobody says what the adapter is) and more often than the others, requests only "
        "where they are one in ten: a read that came late does not show there; or only when its neighbour had already "
        "repeated the token or taken it back, which makes two tokens for a moment.",
        "an overloaded or old station; each round takes longer, and above 20 ms its neighbour repeats the token",
        "firmware and load of the station; Max_Info_Frames of the others",
        explains=("MS102", "MS104", "MS105", "MS106", "MS401", "MS403", "LN101", "LN103", "LN2"),
    ),
    Rule(
        "MS104",
        Severity.ERROR,
        "two tokens on the bus",
        "A station sent although another one had the token, and nothing was damaged or missed before; nor can it have "
        "got the token in frames that the tap did not hear: they had no time, the token never goes that way, or the "
        "other one went on too. At least twice, and only where tokens are in the capture.",
        "a second token after a disturbance, two stations with one address, or a ring joined while running",
        "the stations named: address switches, and whether two segments were joined",
        explains=("MS401", "MS402", "MS403", "LN101", "LN103", "LN2", "LN303"),
    ),
    Rule(
        "MS105",
        Severity.WARNING,
        "station fell out and came back",
        "A station that had been in the ring answered a Poll For Master, so its neighbour had given it up before.",
        "it resets, loses power, or misses its token again and again",
        "its supply, its connection, and the tokens repeated to it",
        explains=("MS301",),
    ),
    Rule(
        "MS106",
        Severity.ERROR,
        "station left the ring",
        "A station did not use its token, was passed over, and has not come back; of one that was away before and came "
        "back, not for twice as long as then. A warning where it is heard all the same.",
        "it is off, disconnected or has crashed",
        "the station's supply and wiring",
        explains=("MS102", "MS301"),
        lasts=True,
    ),
    Rule(
        "MS107",
        Severity.NOTE,
        "token passed to itself",
        "A station sent a token with its own address as destination; a sole master has no need to.",
        "an old station that is or believes to be alone",
        "its firmware; whether it hears the others",
    ),
    Rule(
        "MS108",
        Severity.WARNING,
        "slow round",
        "95 of 100 rounds of the token may take up to 2 s; above that, masters appear off-line to many systems. "
        "Said once, "
        "with those who have the token longest.",
        "too many stations, too low a baud rate, large Max_Info_Frames, or slow stations",
        "the use time of each station, and how many frames each sends on one token",
        explains=("MS603", "LN401"),
    ),
    Rule(
        "MS109",
        Severity.WARNING,
        "alone on the bus",
        "A station polls for masters all the time and never passes a token: nobody answers it. Only noted where slaves "
        "answer what it asks.",
        "it is the only master, or it does not hear the others",
        "wiring and polarity between this station and the next; baud rates",
    ),
    Rule(
        "MS110",
        Severity.ERROR,
        "shut out of the ring",
        "A station that was in the ring and used every token it got has had neither a token nor a poll for 20 "
        "rounds and "
        "more: the one before it passes the token on to a later address without ever having polled those between.",
        "the station that passes the token on does not look for its successor as it must (ASHRAE 135, 9.5.6.2)",
        "firmware of the station that skips it; switch that one off and see whether the other one is in the ring again",
        explains=("MS301",),
    ),
    Rule(
        "MS112",
        Severity.ERROR,
        "passes the token past others",
        "One station passes the token past two and more that are shut out of the ring (MS110) by that.",
        "its Max_Master is lower than its own address, so that it looks for its successor too low; or it does not look "
        "for it at all",
        "Max_Master and firmware of that station; switch it off and see whether the others are in the ring again",
        explains=("MS110",),
    ),
    Rule(
        "MS113",
        Severity.WARNING,
        "never uses its token",
        "A station answers polls for masters, and has not used one token that it was passed for that: twice and "
        "more it was repeated, and then the station given up. Each time costs the bus two waits for it, and the search "
        "for another one.",
        "it does not hear the token, which comes directly behind its answer: its driver is switched off too late after "
        "it has sent, or its program is not ready again",
        "the turnaround of that station: its driver must be off 15 bit times after the last octet (Tpostdrive; ASHRAE "
        "135, 9.5.3); its firmware; or make it a slave",
        explains=("MS102", "MS105", "MS106"),
    ),
    Rule(
        "MS111",
        Severity.WARNING,
        "sent without being asked",
        "A slave, which can have no token (its address is above 127, or it never gets one), sent a frame that "
        "nobody had "
        "asked it for. The station that has the token is not at fault. A single one is only noted.",
        "a slave that answers broadcasts or reports by itself; it runs into the frames of whoever has the token",
        "the slave's settings (unsolicited I-Am, COV), or make it a master",
        explains=("MS101", "MS102", "MS401", "MS402", "MS403", "LN101", "LN103", "LN2"),
    ),
    *POLL_RULES,
    *ANSWER_RULES,
    Rule(
        "MS401",
        Severity.WARNING,
        "damaged frames",
        "Frames whose header or data CRC is wrong, or that end early, more than one in 1000 and at least three. Fewer "
        "than 1 in 100 and not surely over two a minute are only noted.",
        "noise, collisions, wrong termination or bias, or two stations that send at once",
        _WIRING,
    ),
    Rule(
        "MS402",
        Severity.WARNING,
        "damaged frames of one station",
        "Frames of one sender, known by its header or by whose turn it was: at least three and one in 100 of its "
        "frames, and three times as many as its share of the octets would bring if noise hit everybody alike. Octets "
        "that two who use one token may have sent at once count for neither; tables and health count them where the "
        "turn was.",
        "the sender's transceiver, its connection, or somebody who talks over it",
        "that station's connection, and its address",
        explains=("MS401", "MS403", "LN101", "LN103", "LN2"),
    ),
    Rule(
        "MS403",
        Severity.NOTE,
        "noise between frames",
        "More than one octet in 200 belongs to no frame.",
        "weak bias: the idle line floats when drivers switch off",
        _WIRING,
        told_by=("LN201", "LN202", "LN203"),
    ),
    Rule(
        "MS404",
        Severity.ERROR,
        "forbidden address or length",
        "A token or poll to or from an address above 127, a frame from 255, or more than 501 octets of plain data.",
        "an error in the sending station, or another protocol on the line",
        "the station's settings",
    ),
    Rule(
        "MS405",
        Severity.WARNING,
        "last octet missing",
        "At least three damaged frames of one station, and four in five of all its damaged ones, are as they should be "
        "but for their last octet or two, which are missing or wrong.",
        "its driver is switched off too early, before the last octet is out",
        "the turnaround or transmit-delay setting of that station, its firmware, its converter's direction control",
        explains=("MS401", "MS402", "MS102", "MS108", "MS201", "MS301", "LN101", "LN2"),
    ),
    Rule(
        "MS406",
        Severity.WARNING,
        "not heard at this tap",
        "Frames that must have been sent and are not in the capture: the station to which a token usually goes uses "
        "it, and nobody repeats it or polls for another; an answer without its question; who asked goes on long before "
        "it may give up. More than one frame in 100 and three at least, or a station of which nothing is heard at all; "
        "less is noted. A second token, a lost answer or a station that is off would not look so.",
        "the tap or its adapter loses frames, or is too weak there to hear the station; the bus itself works",
        "the tap's place, its wires (both, and the ground), bias and termination there; the computer's load; take no "
        "rates or lost answers from this capture",
    ),
    Rule(
        "MS407",
        Severity.WARNING,
        "check always wrong",
        "Frames of one station that are right but for their data CRC, or for their header CRC: at least five, and 3 in "
        "4 of its damaged ones, with no line error, whose check differs from the right one in the same bits as others "
        "of their length that say something else, or is made by another rule each time (not complemented, its octets "
        "turned, over other octets, another CRC, all zeros or ones), while hardly a frame of the kind is good; or so "
        "many that are octet for octet the same. Noise changes other bits each time.",
        "the device computes its check otherwise: another start value or polynomial, or over other octets",
        "the device's firmware; whether something on the way changes octets",
        explains=("MS401", "MS402", "MS405", "MS102", "MS301", "LN2"),
    ),
    Rule(
        "MS501",
        Severity.ERROR,
        "two stations with one address",
        "What one station cannot have done: it said two device instances in turns, answered a test of its own "
        "address with "
        "other octets than it sent, or now waits for the answer to its polls as it must and now goes on before "
        "there can "
        "be one (8 ms). Another instance that stays is only noted: the device may have been replaced. Damage, lateness "
        "and repeats prove no second station.",
        "two stations with the same MS/TP address: both answer and both use the token",
        "switch one of the suspects off and see whether the address stays alive",
        explains=("MS1", "MS2", "MS3", "MS4", "LN101", "LN103", "LN2", "LN303"),
    ),
    Rule(
        "MS502",
        Severity.WARNING,
        "one device instance twice",
        "Two stations say I-Am with the same device instance, in turns, or while both are heard. One after the other "
        "is only noted: the device may have got another address. 4194303 is nobody's.",
        "two devices that were given one number, as by a copied configuration: who looks for it finds now the one, now "
        "the other",
        "the device instance of the stations named; it is to be unique on all networks that are joined",
    ),
    Rule(
        "MS601",
        Severity.INFO,
        "one station uses most of the line",
        "A station has the token for half of the time and more, and sends eight frames or more with one token.",
        "a large Max_Info_Frames, or a client that asks without pause: all others wait for it",
        "Max_Info_Frames of that station; how often its clients ask",
    ),
    Rule(
        "MS602",
        Severity.WARNING,
        "broadcast storm",
        "More than 20 broadcasts a second for ten seconds and more.",
        "a loop of routers, a program that searches for devices without pause, or COV sent to everybody",
        "who sends them and what they are; whether two routers join the same networks",
        explains=("MS108", "MS603", "LN401", "LN402"),
    ),
    Rule(
        "MS603",
        Severity.NOTE,
        "bus near its limit",
        "Data take nine tenths of the time, and a round takes five times as long as an idle one. Waits for answers are "
        "part of that; those for answers that never come, and for lost tokens, are not.",
        "as much is asked as the line can carry, or as those who answer slowly allow: whatever is added makes all "
        "slower",
        "what is asked how often, and who answers slowly; the baud rate; a second segment",
        told_by=("LN401",),
    ),
)

RULES: dict[str, Rule] = {rule.code: rule for rule in (*_ALL, *CONTENT_RULES, *LENGTH_RULES, *TIME_RULES)}
