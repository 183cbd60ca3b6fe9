//! Tests of descriptions and scene files.
