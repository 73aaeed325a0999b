"""What a rating keeps beside its standings: typed values and their one codec."""
