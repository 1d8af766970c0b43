"""What the figures share: points of finite elements, the rod beside them, and how both are drawn."""
