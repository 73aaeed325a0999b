"""Other products and packages beside ours: each rival in an environment of its own.

A rival is a folder with a `requirements.in` and its locked `requirements.txt`; its environment is
made in `.bench/NAME`, so that nothing of a rival comes near the product's own packages.
"""
