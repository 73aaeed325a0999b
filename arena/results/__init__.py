"""Results of a study: which votes count, ratings, evidence, files and pages."""
