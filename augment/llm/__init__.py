"""Language models over the OpenAI wire: messages, clients, the only door to the network."""
