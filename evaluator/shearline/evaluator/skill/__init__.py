"""The skill of the paper in three layers: semantic, manipulation, control."""
