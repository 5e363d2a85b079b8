"""Words for objects in homes and offices: those of BEAR's 30 classes, and others.

Synonyms are what data sets and model shops call these things (their usual English names, British and American).
"""

CLASSES = (
    "bottle", "cup", "knife", "bowl", "wine glass", "fork", "spoon", "banana", "apple", "orange", "cake",
    "potted plant", "mouse", "keyboard", "laptop", "cell phone", "book", "clock", "chair", "table", "couch", "bed",
    "toilet", "tv", "microwave", "toaster", "refrigerator", "oven", "sink", "person",
)  # fmt: skip

SYNONYMS: dict[str, tuple[str, ...]] = {
    "bottle": ("wine bottle", "water bottle", "flask", "thermos", "decanter"),
    "cup": ("mug", "coffee cup", "coffee mug", "teacup", "tea cup", "tumbler", "drinking glass", "beaker"),
    "knife": ("cleaver", "kitchen knife", "bread knife", "table knife"),
    "bowl": ("fruit bowl", "salad bowl", "soup bowl"),
    "wine glass": ("wineglass", "champagne glass", "champagne flute", "goblet"),
    "fork": ("table fork",),
    "spoon": ("teaspoon", "tablespoon", "table spoon", "tea spoon", "ladle"),
    "banana": (),
    "apple": (),
    "orange": ("tangerine", "mandarin", "clementine"),
    "cake": ("birthday cake", "cupcake", "pie", "gateau", "muffin"),
    "potted plant": (
        "pottedplant", "plant", "house plant", "houseplant", "pot plant", "plant pot", "flower pot",
        "flowerpot", "ficus",
        "monstera", "cactus", "succulent", "bonsai", "fern", "palm", "palm tree", "yucca", "aloe vera",
        "indoor plant",
    ),
    "mouse": ("computer mouse", "wireless mouse"),
    "keyboard": ("computer keyboard",),
    "laptop": ("notebook computer", "laptop computer", "macbook", "notebook pc"),
    "cell phone": (
        "cellphone", "mobile phone", "mobilephone", "smartphone", "smart phone", "i phone", "cellular phone",
        "mobile",
    ),
    "book": ("hardcover", "paperback", "cookbook", "textbook", "novel", "dictionary"),
    "clock": ("alarm clock", "wall clock", "wallclock"),
    "chair": (
        "stool", "armchair", "arm chair", "office chair", "dining chair", "bar stool", "barstool", "recliner",
        "wheelchair", "rocking chair", "highchair", "seat", "ottoman chair", "folding chair", "deckchair",
    ),
    "table": (
        "desk", "coffee table", "dining table", "diningtable", "kitchen table", "side table", "end table",
        "bedside table",
        "conference table", "workbench", "console table", "writing desk", "computer desk", "office desk",
        "work table", "picnic table", "worktable", "coffeetable", "sidetable",
    ),
    "couch": (
        "sofa", "settee", "loveseat", "love seat", "sofa bed", "futon", "divan", "chesterfield", "chaise longue",
    ),
    "bed": ("bunk bed", "single bed", "double bed", "queen bed", "king bed", "cot", "bedstead", "crib", "daybed"),
    "toilet": ("wc", "lavatory", "water closet", "toilet bowl", "toilet seat"),
    "tv": (
        "television", "tvmonitor", "tv monitor", "computer monitor", "monitor", "flat screen", "flatscreen", "tv set",
        "television set", "computer screen", "tv screen", "display", "computer display",
    ),
    "microwave": ("microwave oven",),
    "toaster": (),
    "refrigerator": ("fridge", "freezer", "fridge freezer", "refrigerator freezer"),
    "oven": ("stove oven",),
    "sink": ("washbasin", "wash basin", "basin", "wash hand basin", "kitchen sink", "bathroom sink"),
    "person": ("human", "man", "woman", "boy", "girl", "people", "pedestrian", "mannequin", "character"),
}  # fmt: skip

NO_CLASS = frozenset(
    (
        "air conditioner", "appliance", "arm", "armrest", "art", "ashtray", "attic", "back", "backrest", "backsplash",
        "bag", "balcony", "balustrade", "banister", "bar", "base", "basement", "basket", "bath", "bathroom",
        "bathtub",
        "beam", "bedroom", "bell", "bench", "bidet", "bin", "blanket", "blind", "blinds", "block", "board", "body",
        "bookcase", "bookend", "bookshelf", "box", "bracket", "brick", "broom", "brush", "bucket", "building", "bulb",
        "cabinet", "cable", "camera", "candle", "candlestick", "canvas", "cap", "car", "card", "cardboard", "carpet",
        "case", "ceiling", "chandelier", "chimney", "cloth", "clothes", "coaster", "coat rack", "coffee machine",
        "coffee maker", "colander", "column", "computer", "console", "container", "cooker", "corridor", "counter",
        "countertop", "cover", "cupboard", "curtain", "cushion", "cutlery", "decal", "decor", "decoration", "dish",
        "dishwasher", "door", "doorframe", "doormat", "doorway", "drain", "drape", "drawer", "dresser", "dryer",
        "duct",
        "dumbbell", "eraser", "extractor", "fan", "faucet", "fence", "figurine", "fire extinguisher",
        "fireplace", "flag",
        "floor", "flooring", "flower", "foot", "footrest", "footstool", "frame", "fruit", "furniture", "game console",
        "garage", "garland", "glass", "globe", "grass", "ground", "guitar", "hallway", "hamper", "handle", "handrail",
        "hanger", "headboard", "headphones", "heater", "hinge", "holder", "hood", "hook", "house", "hob", "jar",
        "jug",
        "kettle", "key", "kitchen", "knob", "ladder", "lamp", "lampshade", "landing", "laundry", "lawn", "leaf",
        "leg",
        "lid", "light", "light bulb", "light switch", "lock", "locker", "lounge", "luggage", "magazine",
        "mantel", "mat",
        "mattress", "microphone", "mirror", "mop", "molding", "moulding", "mouse mat", "mouse pad", "mousepad",
        "napkin",
        "nightstand", "notebook", "ottoman", "outlet", "pad", "painting", "pan", "panel", "paper", "patio",
        "pedestal",
        "pen", "pencil", "pendant", "photo", "piano", "picture", "pillar", "pillow", "pipe", "pitcher",
        "placemat", "plane",
        "plank", "plate", "plug", "pot", "poster", "pouf", "printer", "projector", "pump", "quilt", "rack",
        "radiator",
        "radio", "railing", "range hood", "remote", "roof", "room", "rope", "router", "rug", "saucer", "scale",
        "scanner",
        "screen", "shade", "sheet", "shelf", "shelves", "shell", "shoe", "shower", "shutter", "sideboard",
        "sign", "sill",
        "skirting", "sky", "skylight", "slab", "soap", "socket", "speaker", "sponge", "stair", "stairs", "staircase",
        "stand", "statue", "step", "stereo", "stove", "stovetop", "strip", "suitcase", "surface", "switch",
        "tablecloth",
        "tablet", "tank", "tap", "telephone", "terrain", "terrace", "tile", "toilet brush", "toilet paper",
        "toothbrush",
        "towel", "toy", "tray", "trash", "trash can", "trashcan", "tree", "trim", "tripod", "trolley", "tub",
        "umbrella",
        "unit", "vacuum cleaner", "valance", "vanity", "vase", "vent", "wall", "wallpaper", "wardrobe", "washer",
        "washing machine", "waste", "watch", "weight", "wheel", "whiteboard", "window", "windowsill", "wire", "yard",
    )
)  # fmt: skip
"""Nouns that no map of objects names. A "tv stand" is a stand: the last noun of a name says what the thing is."""

COLLIDER_WORDS = frozenset(
    ("ucx", "ubx", "usp", "ucp", "collision", "collisions", "collider", "colliders", "hitbox", "navmesh", "colonly",
     "convcolonly", "trigger", "occluder", "invisible", "col", "physics", "phys")
)  # fmt: skip
"""Words in names of meshes that are there for physics engines (UCX_ … of Unreal, -colonly of Godot), not for eyes."""

TYPICAL_SIZE_M: dict[str, float] = {
    "bottle": 0.28, "cup": 0.12, "knife": 0.22, "bowl": 0.20, "wine glass": 0.20, "fork": 0.19, "spoon": 0.17,
    "banana": 0.19, "apple": 0.08, "orange": 0.08, "cake": 0.25, "potted plant": 0.70, "mouse": 0.11,
    "keyboard": 0.44,
    "laptop": 0.35, "cell phone": 0.15, "book": 0.24, "clock": 0.28, "chair": 0.90, "table": 1.40, "couch": 1.95,
    "bed": 2.05, "toilet": 0.75, "tv": 0.95, "microwave": 0.50, "toaster": 0.30, "refrigerator": 1.70, "oven": 0.70,
    "sink": 0.60, "person": 1.70, "door": 2.05, "wardrobe": 2.00, "window": 1.30, "bathtub": 1.70, "stair": 2.80,
}  # fmt: skip
"""The longest side of things, by which the unit of a file can be told; everyday values, good to a factor of 1.5."""
