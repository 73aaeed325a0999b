"""The prompting strategies of the paper as values, and the pipeline that runs them."""
