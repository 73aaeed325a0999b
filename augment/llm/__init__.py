"""Language models from outside: messages, a client protocol, and the one door to the network."""
