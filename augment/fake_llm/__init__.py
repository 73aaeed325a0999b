"""The stand-in language-model server: real HTTP, no model. It works from the request alone."""
