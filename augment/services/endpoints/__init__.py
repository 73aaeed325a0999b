"""Contestants and whom they ask: endpoints, keys, prices, limits, and what models can do."""
