"""The rules of MS/TP: what each finds, against which limit, and what to check next. MS1 token, MS2 polls, MS3 answers,
MS4 octets and frames, MS5 addresses, MS6 content (`content_findings.py`).
"""

from __future__ import annotations

from dissectors.bacnet.content_findings import CONTENT_RULES
from dissectors.findings import Rule, Severity

_WIRING = "termination and bias at both ends, the shield, and the line's length and stubs"

_ALL = (
    Rule(
        "MS101",
        Severity.ERROR,
        "lost token",
        "Nothing was sent for 500 ms (Tno_token) and then a station began anew: the token was lost "
        "(ASHRAE 135, 9.5.6). The one with the lowest address begins first, 10 ms (Tslot) per address later.",
        "the station that had the token was reset, switched off or disturbed while it passed the token on",
        "power and wiring of the last holder; noise at that moment; whether it answers Test Request",
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
        "A station began to send later than 15 ms (Tusage_delay) after the token reached it. Judged only where the "
        "adapter's timing allows it.",
        "an overloaded or old station; each round takes longer, and above 20 ms its neighbour repeats the token",
        "firmware and load of the station; Max_Info_Frames of the others",
    ),
    Rule(
        "MS104",
        Severity.ERROR,
        "two tokens on the bus",
        "A station sent although another one had the token, and nothing was damaged or missed before. At least twice, "
        "and only where tokens are in the capture.",
        "a second token after a disturbance, two stations with one address, or a ring joined while running",
        "the stations named: address switches, and whether two segments were joined",
    ),
    Rule(
        "MS105",
        Severity.WARNING,
        "station fell out and came back",
        "A station that had been in the ring answered a Poll For Master, so its neighbour had given it up before.",
        "it resets, loses power, or misses its token again and again",
        "its supply, its connection, and the tokens repeated to it",
    ),
    Rule(
        "MS106",
        Severity.ERROR,
        "station left the ring",
        "A station did not use its token, was passed over, and has not come back.",
        "it is off, disconnected or has crashed",
        "the station's supply and wiring",
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
        "95 of 100 rounds of the token may take up to 2 s; above that, masters appear off-line to many systems.",
        "too many stations, too low a baud rate, large Max_Info_Frames, or slow stations",
        "the use time of each station, and how many frames each sends on one token",
    ),
    Rule(
        "MS109",
        Severity.WARNING,
        "alone on the bus",
        "A station polls for masters all the time and never passes a token: nobody answers it.",
        "it is the only master, or it does not hear the others",
        "wiring and polarity between this station and the next; baud rates",
    ),
    Rule(
        "MS201",
        Severity.WARNING,
        "too many polls for masters",
        "A station polls for a new master once in 50 tokens (Npoll); more than one in 10 is counted here, "
        "with the share of time that unanswered polls take. Polls of a search for a successor, the first one or a lost "
        "one, do not count.",
        "a station that does not count to Npoll, or polls far beyond the last address",
        "Max_Master and firmware of the stations named; gaps in the addresses",
    ),
    Rule(
        "MS202",
        Severity.WARNING,
        "slow to answer a poll",
        "A Reply To Poll For Master came later than 15 ms (Tusage_delay) after the poll.",
        "the station risks not being taken into the ring",
        "load and firmware of the station",
    ),
    Rule(
        "MS301",
        Severity.WARNING,
        "no answer",
        "A Data Expecting Reply was followed neither by data nor by Reply Postponed. A single one is only noted.",
        "the station is off, busy or at another address; or the answer was lost on the line",
        "whether it answers other requests; damaged frames at the same time",
    ),
    Rule(
        "MS302",
        Severity.WARNING,
        "late answer",
        "An answer came later than 250 ms (Treply_delay) after the request; the asker gives up at 255 … 300 ms.",
        "the station should send Reply Postponed; its late answer collides with the next token",
        "load and firmware of the station",
    ),
    Rule(
        "MS303",
        Severity.NOTE,
        "many postponed replies",
        "More than one request in 10 was answered with Reply Postponed.",
        "the station does not answer at once, or passes requests on behind a router; its answers wait until it has the "
        "token, however soon they are ready",
        "how long the real answers take: well below 250 ms (Treply_delay) it could have answered at once; its firmware "
        "and load; polling rate of the clients",
    ),
    Rule(
        "MS304",
        Severity.NOTE,
        "broadcast that asks for a reply",
        "A Data Expecting Reply to address 255: nobody may answer it.",
        "an error in the sending station's software",
        "its firmware",
    ),
    Rule(
        "MS305",
        Severity.WARNING,
        "error answer",
        "A station answers a request with Error, Reject or Abort (ASHRAE 135, clause 18), counted "
        "by service, error class and code. A single one is only noted.",
        "the station heard the request well and refuses it; class and code say why",
        "object, property and service asked for, against what the device has; take what it has not out of the client",
    ),
    Rule(
        "MS401",
        Severity.WARNING,
        "damaged frames",
        "Frames whose header or data CRC is wrong, or that end early, more than one in 1000 and at least three.",
        "noise, collisions, wrong termination or bias, or two stations that send at once",
        _WIRING,
    ),
    Rule(
        "MS402",
        Severity.WARNING,
        "damaged frames of one station",
        "Data CRC errors in frames whose header names the sender: at least three and one in 100 of its frames.",
        "the sender's transceiver, its connection, or somebody who talks over it",
        "that station's connection, and its address",
    ),
    Rule(
        "MS403",
        Severity.NOTE,
        "noise between frames",
        "More than one octet in 200 belongs to no frame.",
        "weak bias: the idle line floats when drivers switch off",
        _WIRING,
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
        "MS501",
        Severity.ERROR,
        "two stations with one address",
        "Two devices gave their instance from one address; or an address sent again before its own poll could be "
        "answered (8 ms); or it sent without the token more than twice; or damaged octets came again and again where "
        "it was to answer.",
        "two stations with the same MS/TP address: both answer and both use the token",
        "switch one of the suspects off and see whether the address stays alive",
        explains=("MS4", "LN101", "LN103", "LN2"),
    ),
)

RULES: dict[str, Rule] = {rule.code: rule for rule in (*_ALL, *CONTENT_RULES)}
