"""The whole way with a real language model: `make real-model`."""
