"""The top of the site: its addresses, home, first steps, audit and health."""
