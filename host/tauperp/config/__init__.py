"""One TOML file per installation becomes the constant block that the firmware runs on (firmware/guard/config.h).

    configuration = load_configuration("cell.toml")                 # a file
    configuration = load_configuration("paper", robot="panda")      # a shipped preset, for a shipped robot or a file
    block = configuration.block()                                   # the bytes of guard_config_t

Host tools that need the thresholds, the period or the robot read them from the same object.
"""

from tauperp.config.block import NUMERICS, Numeric, block_crc
from tauperp.config.configuration import LOAD_LIMIT, Configuration
from tauperp.config.load import load_configuration, preset_names
from tauperp.config.settings import TASKS, Settings, TaskName

__all__ = [
    "LOAD_LIMIT",
    "NUMERICS",
    "TASKS",
    "Configuration",
    "Numeric",
    "Settings",
    "TaskName",
    "block_crc",
    "load_configuration",
    "preset_names",
]
