"""The subcommands of `tauperp`, one module each. tauperp.cli states what such a module contains."""
