"""German: 21. November 2026. Numbers keep the point that tables, files and drawings share."""

DATE_FORMAT = "j. F Y"
SHORT_DATE_FORMAT = "j. M Y"
TIME_FORMAT = "H:i:s e"
DATETIME_FORMAT = "j. F Y, H:i e"
SHORT_DATETIME_FORMAT = "j. M Y, H:i e"
DECIMAL_SEPARATOR = "."
THOUSAND_SEPARATOR = "\u202f"
