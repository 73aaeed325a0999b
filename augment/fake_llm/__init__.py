"""The stand-in language-model server: it works from the request alone."""
