//! A table as Apache Parquet, for whoever reads many rows: pandas, Polars, `DuckDB`.
//!
//! One group of rows, not compressed: the same table is the same bytes.

use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;

/// The cells of a column; where one is missing it is null.
#[derive(Clone, Debug, PartialEq)]
pub enum ParquetColumn {
    Integers(Vec<Option<i64>>),
    Numbers(Vec<Option<f64>>),
    Flags(Vec<Option<bool>>),
    Texts(Vec<Option<String>>),
}

/// A file of named columns, all as long as each other.
///
/// # Errors
/// Why they make no table, as the writer says it.
pub fn parquet_table(columns: &[(String, ParquetColumn)]) -> Result<Vec<u8>, String> {
    written(columns).map_err(|e| e.to_string())
}

fn written(columns: &[(String, ParquetColumn)]) -> Result<Vec<u8>, ParquetError> {
    let fields: Result<Vec<_>, ParquetError> = columns
        .iter()
        .map(|(name, column)| column.field(name).map(Arc::new))
        .collect();
    let schema = Type::group_type_builder("table").with_fields(fields?);
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema.build()?), properties)?;
    let mut rows = writer.next_row_group()?;
    for (_, column) in columns {
        let Some(mut into) = rows.next_column()? else {
            break;
        };
        column.write(&mut into)?;
        into.close()?;
    }
    rows.close()?;
    writer.into_inner()
}

impl ParquetColumn {
    fn field(&self, name: &str) -> Result<Type, ParquetError> {
        let (physical, logical) = match self {
            Self::Integers(_) => (Physical::INT64, None),
            Self::Numbers(_) => (Physical::DOUBLE, None),
            Self::Flags(_) => (Physical::BOOLEAN, None),
            Self::Texts(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        Type::primitive_type_builder(name, physical)
            .with_logical_type(logical)
            .with_repetition(Repetition::OPTIONAL)
            .build()
    }

    fn write(&self, into: &mut SerializedColumnWriter) -> Result<(), ParquetError> {
        match self {
            Self::Integers(cells) => fill::<Int64Type>(into, cells.iter().copied()),
            Self::Numbers(cells) => fill::<DoubleType>(into, cells.iter().copied()),
            Self::Flags(cells) => fill::<BoolType>(into, cells.iter().copied()),
            Self::Texts(cells) => {
                let bytes = |text: &String| ByteArray::from(text.as_str());
                fill::<ByteArrayType>(into, cells.iter().map(|cell| cell.as_ref().map(bytes)))
            }
        }
    }
}

/// Values that are there, and for every row whether it has one (definition level 1).
fn fill<T: DataType>(
    into: &mut SerializedColumnWriter,
    cells: impl Iterator<Item = Option<T::T>>,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        levels.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    into.typed::<T>()
        .write_batch(&values, Some(&levels), None)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::RowAccessor as _;

    use super::*;

    #[test]
    fn what_is_written_is_read_back_with_what_is_missing() {
        let columns = [
            ("unit", ParquetColumn::Integers(vec![Some(0), Some(1)])),
            (
                "error_mm",
                ParquetColumn::Numbers(vec![Some(0.1 + 0.2), None]),
            ),
            ("front", ParquetColumn::Flags(vec![Some(true), Some(false)])),
            (
                "error",
                ParquetColumn::Texts(vec![None, Some("3 µm".into())]),
            ),
        ]
        .map(|(name, column)| (name.to_owned(), column));
        let bytes = parquet_table(&columns).unwrap();
        assert_eq!(bytes, parquet_table(&columns).unwrap());
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&bytes).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let rows: Vec<_> = (reader.get_row_iter(None).unwrap())
            .map(Result::unwrap)
            .collect();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].get_long(0).unwrap(), 0);
        assert_eq!(
            rows[0].get_double(1).unwrap().to_bits(),
            (0.1 + 0.2_f64).to_bits()
        );
        assert!(rows[1].get_double(1).is_err() && rows[0].get_string(3).is_err());
        assert!(!rows[1].get_bool(2).unwrap());
        assert_eq!(rows[1].get_string(3).unwrap(), "3 µm");
        // A column that is shorter is no table.
        let short = ("x".to_owned(), ParquetColumn::Flags(vec![None]));
        assert!(parquet_table(&[columns[0].clone(), short]).is_err());
    }
}
