//! `train`: what it refuses.

use super::refused_by;

#[test]
fn wrong_data_and_devices_are_named() {
    let data = ["autoencoder", "--data", "no/such/folder"];
    refused_by("train", &data, &["no/such/folder", "make_dataset"]);
    refused_by(
        "train",
        &["autoencoder", "--device", "tpu"],
        &["tpu", "flex"],
    );
}
