"""What the voting page asks: the pair, its pictures and how far somebody is."""
