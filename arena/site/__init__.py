"""The site itself: home, first steps, audit, health, and what all pages share."""
