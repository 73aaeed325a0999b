"""Lists of words: those that mean nothing for a placement, nouns, and what is refused."""

from __future__ import annotations

from augment.instruction.tokens import word_set

FILLERS = frozenset(
    word
    for line in (
        "a an the this that these those there it its they them their he she his her",
        "and as while also then so where which who whose what with but both now too",
        "is are was were be being been has have had having do does get gets got",
        "should shall will can could would want wants need we you i please kindly just like us me",
        "add adds adding put puts place places placed insert create generate make position set",
        "let assume imagine suppose set up stage scene scenario introduce include spawn simulate",
        "show depict consider give model drop locate situate located situated positioned placing",
        "appears appear exists exist happens lies lie finds itself found",
        "somebody someone driver drivers motorist motorists idiot owner",
        "suddenly currently already still simply",
        "'d 'll 've 're 'm",
        "leave namely i e g eg ie etc here thereby thus hence therefore moreover additionally",
    )
    for word in line.split()
)
"""Words that change nothing about a placement; sides, numbers and most prepositions never are."""

MARKS = frozenset(".,;:()!?\"'/“”‘’–—")
"""Marks that may stand between phrases."""

SENTENCE_ENDS = frozenset(".;!?:")

ADDING = word_set(
    "add adds put puts place insert create generate set park position introduce spawn let"
)
"""Verbs that begin what is to be added."""

BODY_WORDS = word_set(
    "automobile hatchback saloon cab limousine jeep estate pickup hatchbacks saloons cabs",
    "campervan ambulance motorhome transporter automobiles sedans pickups minivans hgv suvs",
    "vehicle car automobile sedan van truck lorry bus coach minivan vehicles cars vans trucks "
    "lorries buses coaches taxi suv minibus",
)
OTHER_NOUNS = word_set(
    "lady gentleman guy bloke fellow lad teenager toddler schoolchild pensioner jogger runner",
    "ladies gentlemen guys teenagers boy girl kid boys girls kids children men women student",
    "pileup wreck shunt",
    "pedestrian pedestrians person people walker walkers jaywalker jaywalkers cone cones pylon "
    "pylons worker workers workman accident crash collision roadworks child man woman",
)
"""Nouns that something new could be named by."""

PLACE_WORDS = word_set(
    "left right half partly partially shoulder kerb curb behind ahead front facing towards toward "
    "turned degrees middle centre center sideways across angle"
)
"""Words about a place: a clause about something else than the ego is not passed over with one."""

REFUSED = {
    **dict.fromkeys(
        ("not", "no", "never", "without", "don", "doesn", "isn", "except", "neither", "nor", "t"),
        "negations are not understood",
    ),
    **dict.fromkeys(
        ("remove", "delete", "erase", "clear", "move", "shift", "replace", "swap", "exchange"),
        "only adding to the scene is understood",
    ),
    **dict.fromkeys(("or", "either", "unless", "if"), "alternatives are not understood"),
}
"""Words whose refusal can say more than that the word is unknown."""
