"""The subcommands of `tauperp`, a module each; tauperp.cli says what such a module holds."""
