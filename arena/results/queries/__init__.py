"""Which votes count, who may read results, and the evidence behind a number."""
