"""From votes to ratings, intervals and ranks: numpy and scipy only, values in, values out."""
