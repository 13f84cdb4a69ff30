"""``shearline bench transport``: the full path beside a raw Zenoh echo, in processes of its own."""
