"""Files of benchmarks and sweeps."""
