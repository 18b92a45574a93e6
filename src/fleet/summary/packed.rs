//! The summary as Parquet.

use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::Column;

/// The columns as a file, one row group.
pub(super) fn pack(columns: &[(String, Column)], rows: usize) -> Result<Vec<u8>, ParquetError> {
    let mut fields = Vec::with_capacity(columns.len());
    for (name, column) in columns {
        let field = match column {
            Column::Text(_) => {
                Type::primitive_type_builder(name, Physical::BYTE_ARRAY).with_logical_type(Some(LogicalType::String))
            }
            Column::Number(_) => Type::primitive_type_builder(name, Physical::DOUBLE),
        };
        fields.push(Arc::new(field.with_repetition(Repetition::OPTIONAL).build()?));
    }
    let schema = Arc::new(Type::group_type_builder("summary").with_fields(fields).build()?);
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(format!("eixo {}", env!("CARGO_PKG_VERSION")))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    if rows > 0 {
        let mut group = writer.next_row_group()?;
        for (_, column) in columns {
            let Some(mut own) = group.next_column()? else { break };
            match column {
                Column::Text(values) => {
                    let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
                    let present: Vec<ByteArray> =
                        values.iter().flatten().map(|v| ByteArray::from(v.as_str())).collect();
                    own.typed::<ByteArrayType>().write_batch(&present, Some(&levels), None)?;
                }
                Column::Number(values) => {
                    let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
                    let present: Vec<f64> = values.iter().flatten().copied().collect();
                    own.typed::<DoubleType>().write_batch(&present, Some(&levels), None)?;
                }
            }
            own.close()?;
        }
        group.close()?;
    }
    writer.into_inner()
}
