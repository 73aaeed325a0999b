"""Rating a study and storing what comes out."""
