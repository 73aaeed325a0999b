"""Pages of jobs, of what came out and of how it was judged and driven."""
