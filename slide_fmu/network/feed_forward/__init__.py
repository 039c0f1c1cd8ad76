"""The feed-forward family has its network, its byte layout and its gradient here."""
