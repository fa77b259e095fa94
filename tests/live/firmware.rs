//! The firmware's frames, compiled on this machine and held against the vectors of the specification.
#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Stdio};

const PROGRAM: &str = r#"
#include <stdio.h>
#include "hapd_frame.h"

static void show(hapd_frame *frame) {
  uint8_t wire[HAPD_WIRE];
  size_t n = hapd_end(frame, wire);
  for (size_t i = 0; i < n; i++) printf(i ? " %02x" : "%02x", wire[i]);
  printf("\n");
  /* And back. */
  hapd_inbox in;
  hapd_frame found;
  memset(&in, 0, sizeof in);
  int sound = 0;
  for (size_t i = 0; i < n; i++) sound += hapd_take(&in, wire[i], &found);
  if (sound != 1 || found.length != frame->length - 2 || memcmp(found.bytes, frame->bytes, found.length))
    printf("not read back\n");
  /* A bit turned over anywhere is noticed. */
  for (size_t i = 0; i + 1 < n; i++)
    for (int b = 0; b < 8; b++) {
      wire[i] ^= 1 << b;
      int wrong = 0;
      for (size_t k = 0; k < n; k++)
        if (hapd_take(&in, wire[k], &found) && found.length == frame->length - 2) wrong = 1;
      if (wrong) printf("bit %d of byte %d passed\n", b, (int)i);
      wire[i] ^= 1 << b;
    }
}

int main(void) {
  hapd_frame f;
  uint32_t counts[12], none[12] = {0};
  if (hapd_crc((const uint8_t *)"123456789", 9) != 0x29B1) printf("wrong sum\n");
  for (int k = 0; k < 12; k++) counts[k] = 2048 + 100 * k;
  hapd_begin(&f, HAPD_HELLO, 0, 0);
  hapd_put_hello(&f, 0xC0FFEE01u, 12, 12, 3300, 5000, 330000, 1000, "shin, left");
  show(&f);
  hapd_begin(&f, HAPD_DATA, 1, 1000);
  hapd_put_counts(&f, counts, 12, 12);
  show(&f);
  hapd_begin(&f, HAPD_DATA, 2, 2000);
  hapd_put_counts(&f, none, 12, 12);
  show(&f);
  hapd_begin(&f, HAPD_STATUS, 3, 3000);
  hapd_put(&f, 3, 4);
  hapd_put(&f, 2150, 2);
  show(&f);
  hapd_begin(&f, HAPD_START, 0, 0);
  show(&f);
  hapd_begin(&f, HAPD_RATE, 1, 0);
  hapd_put(&f, 500, 2);
  show(&f);
  /* Too much is cut off, and stays a sound frame. */
  hapd_begin(&f, HAPD_LOG, 4, 0);
  for (int k = 0; k < 400; k++) hapd_put(&f, 1 + k % 255, 1);
  uint8_t wire[HAPD_WIRE];
  if (hapd_end(&f, wire) != HAPD_WIRE) printf("not cut off\n");
  return 0;
}
"#;

#[test]
fn the_firmware_speaks_as_the_specification_shows() {
    // The compiler that Rust links with.
    let compiler = Command::new("cc")
        .arg("--version")
        .stdout(Stdio::null())
        .status();
    assert!(
        compiler.is_ok(),
        "no C compiler: Rust links with one, install gcc and libc6-dev"
    );
    let folder = tempfile::tempdir().unwrap();
    let (source, program) = (folder.path().join("host.c"), folder.path().join("host"));
    std::fs::write(&source, PROGRAM).unwrap();
    let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/firmware");
    let built = Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-I"])
        .arg(firmware.join("hapd"))
        .arg(&source)
        .arg("-o")
        .arg(&program)
        .output()
        .unwrap();
    assert!(
        built.status.success(),
        "{}",
        String::from_utf8_lossy(&built.stderr)
    );
    let said = Command::new(&program).output().unwrap();
    let said = String::from_utf8(said.stdout).unwrap();
    let specification = std::fs::read_to_string(firmware.join("PROTOCOL.md")).unwrap();
    assert_eq!(said.lines().count(), 6, "{said}");
    for line in said.lines() {
        assert!(specification.contains(&format!("    {line}\n")), "{line}");
    }
}
