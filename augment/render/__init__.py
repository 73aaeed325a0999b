"""Bird's-eye-view pictures of a scene."""
