"""``python -m shearline.deploy`` is the ``shearline`` command."""

from shearline.deploy.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
