"""What is measured about stored augmentations: checks, displacement, drives."""
