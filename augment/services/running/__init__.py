"""Jobs as they run: what they may use, who works on which row, each call, and what came out."""
