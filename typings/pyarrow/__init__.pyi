# Just the calls used.
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

class Array:
    type: DataType

class DataType: ...

class FixedSizeListArray(Array):
    @staticmethod
    def from_arrays(values: Array, list_size: int) -> FixedSizeListArray: ...

class DictionaryArray(Array):
    @staticmethod
    def from_arrays(indices: Array, dictionary: Array) -> DictionaryArray: ...

class Field:
    metadata: dict[bytes, bytes] | None

class Table:
    column_names: list[str]
    num_columns: int
    num_rows: int
    schema: Schema
    @staticmethod
    def from_arrays(arrays: Sequence[Array], *, schema: Schema) -> Table: ...
    def column(self, i: int | str) -> ChunkedArray: ...
    def to_pydict(self) -> dict[str, list[Any]]: ...

class ChunkedArray:
    def to_numpy(self) -> NDArray[Any]: ...
    def to_pylist(self) -> list[Any]: ...

class Schema:
    metadata: dict[bytes, bytes] | None
    names: list[str]
    def field(self, i: int | str) -> Field: ...

def array(
    obj: NDArray[np.generic] | Sequence[Any],
    type: DataType | None = None,
    mask: NDArray[np.bool_] | None = None,
) -> Array: ...
def field(name: str, type: DataType, metadata: Mapping[str, str] | None = None) -> Field: ...
def schema(fields: Sequence[Field], metadata: Mapping[str, str] | None = None) -> Schema: ...
def string() -> DataType: ...
def table(
    data: Mapping[str, NDArray[np.generic] | Sequence[Any]],
    *,
    metadata: Mapping[str, str] | None = None,
) -> Table: ...
