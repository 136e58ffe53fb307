//! Conversions between values of the libraries and of Python.

use crate::error::exceptions::SceneError;
use crate::error::{Fault, Outcome};
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde::Serialize;
use serde_json::Value;
use wake_physics::Field;

/// Largest depth of nested tables in a scene.
const DEEPEST: usize = 8;

/// Largest length of an array of numbers in a scene or a recipe.
const MOST_VALUES: usize = 10_000;

/// Converts a value that can be serialized as JSON to dictionaries, lists, numbers and text.
pub(crate) fn json<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let value = serde_json::to_value(value).map_err(|error| SceneError::new_err(error.to_string()));
    python_of(py, &value?)
}

fn python_of<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(value) => PyBool::new(py, *value).to_owned().into_any(),
        Value::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(whole), _) => whole.into_pyobject(py)?.into_any(),
            (_, Some(whole)) => whole.into_pyobject(py)?.into_any(),
            _ => PyFloat::new(py, number.as_f64().unwrap_or(f64::NAN)).into_any(),
        },
        Value::String(text) => PyString::new(py, text).into_any(),
        Value::Array(values) => {
            let list = PyList::empty(py);
            for value in values {
                list.append(python_of(py, value)?)?;
            }
            list.into_any()
        }
        Value::Object(entries) => {
            let dict = PyDict::new(py);
            for (key, value) in entries {
                dict.set_item(key, python_of(py, value)?)?;
            }
            dict.into_any()
        }
    })
}

/// Converts a TOML value to a Python value. Whole scenes use it, since TOML keeps their numbers, infinity too.
pub(crate) fn python_of_toml<'py>(
    py: Python<'py>,
    value: &toml::Value,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        toml::Value::String(text) => PyString::new(py, text).into_any(),
        toml::Value::Integer(whole) => whole.into_pyobject(py)?.into_any(),
        toml::Value::Float(number) => PyFloat::new(py, *number).into_any(),
        toml::Value::Boolean(value) => PyBool::new(py, *value).to_owned().into_any(),
        toml::Value::Datetime(time) => PyString::new(py, &time.to_string()).into_any(),
        toml::Value::Array(values) => {
            let list = PyList::empty(py);
            for value in values {
                list.append(python_of_toml(py, value)?)?;
            }
            list.into_any()
        }
        toml::Value::Table(table) => {
            let dict = PyDict::new(py);
            for (key, value) in table {
                dict.set_item(key, python_of_toml(py, value)?)?;
            }
            dict.into_any()
        }
    })
}

/// Converts a Python value to TOML: numbers (of `NumPy`, too), text, lists and dictionaries; `None` for `None`.
///
/// - `name`: name of the value in errors
pub(crate) fn toml_of(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<toml::Value>> {
    toml_at(name, value, DEEPEST)
}

fn toml_at(name: &str, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<Option<toml::Value>> {
    if depth == 0 {
        let text =
            format!("{name} is nested more than {DEEPEST} levels deep, deeper than any scene");
        return Err(SceneError::new_err(text));
    }
    if value.is_none() {
        return Ok(None);
    }
    if let Ok(value) = value.cast::<PyBool>() {
        return Ok(Some(value.is_true().into()));
    }
    if value.is_instance_of::<PyInt>() {
        return whole(name, value).map(Some);
    }
    if let Ok(value) = value.cast::<PyFloat>() {
        return Ok(Some(value.value().into()));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Some(text.to_str()?.into()));
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        return table(name, dict, depth).map(|table| Some(table.into()));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let mut values = Vec::new();
        for (n, value) in value.try_iter()?.enumerate() {
            let name = format!("{name}[{n}]");
            let value = toml_at(&name, &value?, depth - 1)?;
            values.push(value.ok_or_else(|| wrong(&name, "None"))?);
        }
        return Ok(Some(values.into()));
    }
    // Scalars and arrays of NumPy. A view of few bytes may have more values than fit in memory.
    let size = value
        .getattr("size")
        .and_then(|size| size.extract::<usize>());
    if let Ok(size) = size
        && size > MOST_VALUES
    {
        let text =
            format!("{name} is an array of {size} values, expected at most {MOST_VALUES} values");
        return Err(SceneError::new_err(text));
    }
    if let Ok(plain) = value.call_method0("tolist")
        && !plain.is(value)
    {
        return toml_at(name, &plain, depth - 1);
    }
    Err(wrong(name, &value.get_type().name()?.to_string()))
}

fn table(name: &str, dict: &Bound<'_, PyDict>, depth: usize) -> PyResult<toml::Table> {
    let mut table = toml::Table::new();
    for (key, value) in dict.iter() {
        let key = key.cast::<PyString>().map_err(|_| {
            PyTypeError::new_err(format!(
                "a key of {name} is not a string, expected the keys of a scene file"
            ))
        })?;
        let key = key.to_str()?.to_owned();
        if let Some(value) = toml_at(&format!("{name}.{key}"), &value, depth - 1)? {
            table.insert(key, value);
        }
    }
    Ok(table)
}

fn wrong(name: &str, found: &str) -> PyErr {
    PyTypeError::new_err(format!(
        "{name} is {found}, expected a number, text, a list or a dictionary"
    ))
}

/// Converts a whole number to TOML, in which seeds of 2⁶³ and above are text.
fn whole(name: &str, value: &Bound<'_, PyAny>) -> PyResult<toml::Value> {
    if let Ok(value) = value.extract::<i64>() {
        return Ok(value.into());
    }
    let value = value.extract::<u64>().map_err(|_| {
        SceneError::new_err(format!(
            "{name} is a whole number of more than 64 bits, expected -2^63 to 2^64 - 1"
        ))
    })?;
    Ok(value.to_string().into())
}

/// Converts a field to an array `[rows, columns]`, without a copy.
pub(crate) fn array_of<'py>(py: Python<'py>, field: Field) -> PyResult<Bound<'py, PyArray2<f32>>> {
    array2(py, field.values, [field.rows, field.columns])
}

/// Converts values to an array `[rows, columns]`, without a copy.
pub(crate) fn array2<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    size: [usize; 2],
) -> PyResult<Bound<'_, PyArray2<T>>> {
    PyArray1::from_vec(py, values).reshape(size)
}

/// Checks that `count` images of `[rows, columns]` pixels of `bytes` bytes fit in half of the free memory.
pub(crate) fn check_memory(
    what: &str,
    count: usize,
    [rows, columns]: [usize; 2],
    bytes: usize,
) -> Outcome<()> {
    let needed = [count, rows, columns, bytes]
        .iter()
        .try_fold(1u64, |product, &n| product.checked_mul(n as u64));
    let free = wake_physics::available_memory().unwrap_or(u64::MAX);
    // An array that fills the free memory leaves none for computing it.
    match needed.filter(|&needed| needed <= free / 2) {
        Some(_) => Ok(()),
        None => Err(Fault::too_large(format!(
            "{what}: {count} images of {rows} x {columns} pixels need more than half of the {:.1} GiB of free memory; \
             ask for fewer images at a time",
            free as f64 / f64::from(1 << 30)
        ))),
    }
}
