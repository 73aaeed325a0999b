"""From a recorded scene to a changed one; knows no arena and no HTTP server."""
