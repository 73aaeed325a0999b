"""From a scene to the text that a model reads, and from its answer to a Modification."""
