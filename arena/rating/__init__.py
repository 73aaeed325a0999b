"""From votes to a rated table. Knows numpy and no framework; read leaderboard.py first."""
