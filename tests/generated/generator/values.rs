//! Values that several parts of a document are drawn from.

use proptest::prelude::*;
use serde_json::{Value, json};

/// A coefficient of 0 to `most`: a number, or in coloured documents three.
pub fn coefficient(most: f64, coloured: bool) -> BoxedStrategy<Value> {
    let number = prop_oneof![1 => Just(0.0), 8 => 0.0..most];
    match coloured {
        true => proptest::array::uniform3(number).prop_map(|rgb| json!(rgb)).boxed(),
        false => number.prop_map(|value| json!(value)).boxed(),
    }
}

/// Two coefficients whose sum is at most `most`.
pub fn two(most: f64, coloured: bool) -> impl Strategy<Value = [Value; 2]> {
    (coefficient(0.6 * most, coloured), coefficient(0.4 * most, coloured)).prop_map(|(a, b)| [a, b])
}

/// Three numbers of a field.
pub fn three(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|axis| value[axis].as_f64().unwrap())
}
