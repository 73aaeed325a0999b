"""Words that no rule knows: which may be passed over anywhere, and which never are.

The first list is of words whose absence leaves every placement as it is. The second is of words
that change or revoke one: negations, alternatives, comparisons, doubts, places, motion, times,
and what makes a noun another thing ("toy car").
"""

from __future__ import annotations

from augment.instruction.tokens import word_set

SAFE = word_set(
    # Verbs of creating and asking for, in the moods that they are asked in.
    "draw drawn draws render renders rendered depicts depicted shows shown display displayed",
    "picture envision envisage visualise visualize conjure arrange install deploy plonk stick",
    "dump dumped plop pop chuck throw bring bringing build compose construct establish produce",
    "feature features featuring provide provided provides prepare modelled modeled mock try use",
    "give given gives grab request requested require required requires desire desired ask asked",
    "asking hope wish like love prefer liked loved fancy thinking think thought guess thanks",
    "thank cheers ta hi hey hello dear mate folks ok okay alright well um uh er hmm oh ah ooh",
    "wow oops gosh damn bloody",
    # Verbs of being somewhere.
    "looms loom looming lurks lurk lurking lingers linger lingering loiters loitering remains",
    "remain remaining resides residing sat stood lay lain laid occurs occur occurring occurred",
    "happened happening arises arise emerged materialises materializes popped pops shows dwells",
    "perched perches ended tarries idles idling idled languishes languishing awaits await",
    "awaiting poses posing presents present presented comprises encountered encounter",
    "encounters met meet meets see sees seen saw spot spots spotted notice notices noticed",
    "observe observes observed find finds finding discover discovers detect detects detected",
    "face faced confronts confronted approached greets greeted there're waits",
    # Verbs of how something came to stand where it is.
    "dumped ditched deserted forsaken forgotten halted immobilised immobilized marooned strand",
    "stranded broke conked packed died failed",
    # Adverbs of manner, of the speaker and of time that leave a placement as it is.
    "quite rather very really pretty fairly so too again even ever indeed anyway basically",
    "actually obviously clearly simply merely sadly unfortunately luckily apparently evidently",
    "presumably surprisingly suddenly abruptly meanwhile somehow today tonight now furthermore",
    "likewise moreover plus finally firstly nonetheless though although however therefore",
    "accordingly overall specifically particularly especially illegally legally recklessly",
    "foolishly stupidly hurriedly patiently quietly silently blindly absentmindedly",
    "thoughtlessly cautiously nervously idly lazily happily merrily unlawfully wrongfully",
    "inconveniently awkwardly inconsiderately conveniently neatly squarely visibly plainly",
    "solely undoubtedly undeniably deliberately definitely necessarily motionlessly unattended",
    "unoccupied empty driverless lawlessly whatsoever nicely properly correctly accurately",
    # Adjectives of colour, age, size by feel and state.
    "purple pink violet beige maroon turquoise golden gold cream navy crimson scarlet metallic",
    "shiny glossy matte dirty dusty muddy rusty rusted battered shabby tatty new brand fancy",
    "posh ugly pretty lovely nice beautiful fine huge massive giant enormous medium mid sized",
    "tiny short long slim slender heavy lightweight lonesome solitary random arbitrary generic",
    "common everyday usual standard simple plain certain particular given unlucky hapless poor",
    "careless impatient reckless hurried anonymous unknown unnamed local foreign electric",
    "diesel hybrid petrol british german american european loaded laden unladen modern vintage",
    "classic elderly drunk drunken sleepy tired hasty inattentive oblivious confused unwary",
    "unsuspecting daydreaming frail healthy happy sad angry nasty serious minor major bad",
    "terrible horrible awful severe ghastly unpleasant unexpected broken faulty defective",
    "inoperable abandoned inconvenient annoying pesky blasted damaged dented wrecked old grubby",
    "stray decrepit derelict rickety ramshackle dilapidated fluorescent reflective plastic",
    "bright striped visible temporary mobile",
    # Nouns of discourse.
    "scenario scenarios situation case example instance task exercise episode setting picture",
    "story note notes reminder attention warning caution",
)
"""Passed over wherever they stand."""

NEVER = word_set(
    # Negation, absence, revocation.
    "not no never none nobody nothing nowhere neither nor without cannot cant wont dont didnt",
    "isnt arent wasnt hasnt shouldnt wouldnt couldnt hardly barely scarcely rarely seldom lacks",
    "lack lacking absent missing minus negative zero instead except excluding exclude excludes",
    "omit omitting skip skipping ignore ignoring disregard forget avoid avoiding prevent",
    "preventing forbid forbidden ban banned prohibit prohibited refuse refrain cancel cancelled",
    "undo undone stop cease remove removed removing delete deleted erase erased clear cleared",
    "hide hides hiding hidden bearing invisible imaginary virtual fake hypothetical dismiss",
    "discard eliminate eliminated fail fails unlike unable impossible wrong incorrect false",
    "untrue un gone away vanish vanished vanishes vanishing disappear disappears disappeared",
    "depart departed departs withdraw withdrawn replace replaced swap swapped exchange move",
    "moves moved shift shifts",
    # Alternatives, conditions, doubt.
    "or either else otherwise alternatively if unless whether maybe perhaps possibly probably",
    "might may sometimes occasionally usually potentially supposedly allegedly hypothetically",
    "theoretically conditionally optionally optional preferably yesterday tomorrow formerly",
    "previously earlier once ago before after later eventually soon future past until till",
    # Comparison, quantity.
    "than more less fewer most least much many several few couple dozen dozens hundreds",
    "multiple numerous various every each all any some both half third quarter twice double",
    "triple thrice single pair another additional extra maximum minimum max min over under",
    "above below upto exceeding within beyond per times approximately respectively total",
    "altogether average equal equally same different opposite reverse reversed inverted",
    "mirrored vice versa",
    # Places and directions.
    "left right ahead behind front rear back forward backward forwards backwards beside besides",
    "between amid among amongst near nearby close closer closest far farther further nearest",
    "off on in at to from of by into onto out outside inside outer inner up down upward",
    "downward across along alongside around round through throughout against toward towards via",
    "opposite abreast adjacent parallel perpendicular diagonal diagonally lateral laterally",
    "longitudinal longitudinally vertically horizontally sideways lengthwise lengthways",
    "crosswise clockwise anticlockwise upstream downstream uphill downhill north south east",
    "west northbound southbound eastbound westbound offside nearside driver passenger port",
    "starboard top bottom middle midway halfway centre center edge corner end start beginning",
    "underneath beneath atop aloft overhead here there elsewhere apart together upside inverted",
    "angled askew skewed slanted slantwise tilted rotated crooked crookedly oblique obliquely",
    "straight",
    # Units and things that are counted with another noun.
    "length lengths width widths inches inch mile miles mi step steps seconds second minutes",
    "minute hours hour percent degrees radians radian rad kph kmh mph square cubic",
    # What makes a noun another thing, or moves it.
    "toy model miniature cardboard inflatable cable golf tram train rail railway dining bumper",
    "fork forklift pallet hand pine ice snow moving crossing turning flying driving overtaking",
    "reversing oncoming approaching departing merging speeding racing passing convoy trailer",
    "drone robot dummy mannequin statue painted",
    # Words of other languages that stand where a relation does.
    "ein eine einen einem der das den dem und oder auf vor mit von links rechts nicht kein",
    "keine keinen hinter vorne neben zwischen ohne nach zum zur im am bei le la les une et sur",
    "dans devant derriere pas ne gauche droite avec sans el los las un y en con sin delante",
    "detras izquierda derecha coche uno il lo gli davanti dietro senza een het niet geen voor",
    "achter",
)
"""Never passed over, whatever stands around them."""

NEVER_STEMS = (
    *("overturn", "upturn", "flip", "roll", "invert", "revers", "mirror", "rotat", "turn", "spin"),
    *("stretch", "span", "measur", "extend", "rais", "elevat", "lengthen", "spac", "separat"),
    *("reach", "occup", "travel", "mov", "driv", "delet", "remov", "eras", "vanish"),
    *("disappear", "depart", "overtak", "merg", "speed", "rac", "swerv", "chang", "tailgat"),
    *("accelerat", "brak", "cross", "pass", "fly", "fall", "float", "sink", "climb", "descend"),
    *("exclud", "omit", "skip", "ignor", "forbid", "prevent", "avoid", "cancel", "replac"),
    *("narrow", "widen", "shorten", "doubl", "tripl", "halv", "miss", "lack", "multipl", "repeat"),
    *("jackknif", "somersault", "topple", "tow", "pull", "push", "drag", "follow", "lead"),
    *("precede", "surround", "flank", "oppos", "adjoin", "neighbo", "swap", "shift", "slid"),
    *("back", "leav", "escap", "fleei", "retreat", "retir", "end", "start", "finish", "begin"),
    *("tilt", "angl", "lean", "slop", "bend", "curv", "swing", "swung", "veer", "drift"),
    *("un", "non", "dis", "anti", "mis", "pseudo", "quasi", "semi", "half"),
    *("mount", "expect", "intend", "plann", "permit", "allow", "reject", "declin", "threat"),
    *("want", "wish", "predict", "assum", "suppos", "pretend", "fictiti", "former", "carr"),
    *("rid", "hold", "sav", "spar", "banish", "withh", "almost", "near", "opt"),
    *("connect", "attach", "join", "alternat", "differ", "exceed", "increas", "decreas", "reduc"),
)
"""Beginnings of verb forms ("-ed", "-ing") and adverbs that change a placement."""
