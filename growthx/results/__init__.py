"""What a run leaves on disk and reads back: fields for ParaView, the history as CSV, checkpoints.

Nothing is overwritten.  What users call is here by its name.
"""

from growthx.post.derived import FIELDS, cell_fields, node_fields, point_fields, register
from growthx.post.fields.row import DerivedField
from growthx.results.fields import FieldWriter
from growthx.results.folders import free_folder, new_folder
from growthx.results.history import write_history
from growthx.results.numbers import summary
from growthx.results.writing import write

__all__ = [
    "FIELDS",
    "DerivedField",
    "FieldWriter",
    "cell_fields",
    "free_folder",
    "new_folder",
    "node_fields",
    "point_fields",
    "register",
    "summary",
    "write",
    "write_history",
]
