//! Hand-computed bytes, and invalid messages.

use super::*;

#[test]
fn bytes_match_the_hand_computed_ones() {
    let mut cdr = CdrWriter::new();
    cdr.u8(7);
    cdr.u32(0x0102_0304); // three bytes of padding
    cdr.string("ab"); // no padding: the length is at 8
    cdr.f64(1.0); // the string ends at 15: one byte of padding
    cdr.i8(-1);
    cdr.f32(-2.0); // three bytes of padding
    cdr.length(0); // an empty sequence of doubles is its length alone
    let expected: &[u8] = &[
        0, 1, 0, 0, // encapsulation, not counted in alignment
        7, 0, 0, 0, 4, 3, 2, 1, // 0…7
        3, 0, 0, 0, b'a', b'b', 0, 0, // 8…15
        0, 0, 0, 0, 0, 0, 0xf0, 0x3f, // 16…23
        0xff, 0, 0, 0, 0, 0, 0, 0xc0, // 24…31
        0, 0, 0, 0,
    ];
    assert_eq!(cdr.into_bytes(), expected);
}

#[test]
fn what_was_written_is_read() {
    let mut cdr = CdrWriter::new();
    cdr.bool(true);
    cdr.f64(-0.1);
    cdr.string("pose");
    cdr.i32(-5);
    cdr.i8(2);
    cdr.f32(f32::INFINITY);
    cdr.byte_sequence(&[1, 2, 3]);
    let bytes = cdr.into_bytes();
    let mut read = CdrReader::new(&bytes).expect("header");
    assert_eq!(read.u8(), Ok(1));
    assert_eq!(read.f64(), Ok(-0.1));
    assert_eq!(read.string(), Ok("pose"));
    assert_eq!(read.i32(), Ok(-5));
    assert_eq!(read.i8(), Ok(2));
    assert_eq!(read.f32(), Ok(f32::INFINITY));
    assert_eq!(read.length(1), Ok(3));
}

#[test]
fn corrupt_messages_are_errors() {
    assert!(matches!(CdrReader::new(&[0, 1]), Err(CdrError::Encapsulation(_))));
    assert!(matches!(
        CdrReader::new(&[0, 0, 0, 0, 1]),
        Err(CdrError::Encapsulation(_))
    ));
    // A length of 2³² − 1 in a body of four bytes: an error at once, not an allocation.
    let huge = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff];
    let open = || CdrReader::new(&huge).expect("header");
    assert!(matches!(open().length(8), Err(CdrError::Truncated { .. })));
    assert!(matches!(open().string(), Err(CdrError::Truncated { .. })));
    assert!(matches!(open().f64(), Err(CdrError::Truncated { .. })));
    let unterminated = [0, 1, 0, 0, 1, 0, 0, 0, b'x'];
    assert_eq!(
        CdrReader::new(&unterminated).expect("header").string(),
        Err(CdrError::BadString { at: 4 })
    );
}
