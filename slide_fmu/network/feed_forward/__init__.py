"""The feed-forward family: its network, its byte layout, its gradient."""
