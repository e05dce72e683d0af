//! PLY as tools write it.

use super::*;

#[test]
fn ply_reads_the_same_in_all_encodings() {
    let header = |encoding: &str| {
        format!(
            "ply\r\nformat {encoding} 1.0\r\ncomment a box\r\nelement extra 1\r\nproperty list uchar short junk\r\n\
             element vertex 4\r\nproperty uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\n\
             property float32 x\r\nproperty float64 y\r\nproperty float z\r\n\
             element face 4\r\nproperty list uint8 int32 vertex_index\r\nend_header\r\n"
        )
    };
    let vertices = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.1, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let faces = [[0_i32, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let mut ascii = header("ascii") + "2 7 8\n\n";
    let mut little = header("binary_little_endian").into_bytes();
    let mut big = header("binary_big_endian").into_bytes();
    for (bytes, swap) in [(&mut little, false), (&mut big, true)] {
        let mut put = |mut field: Vec<u8>| {
            if swap {
                field.reverse();
            }
            bytes.extend(field);
        };
        put(vec![2]);
        put(7_i16.to_le_bytes().to_vec());
        put(8_i16.to_le_bytes().to_vec());
        for v in vertices {
            (0..3).for_each(|_| put(vec![255]));
            put((v[0] as f32).to_le_bytes().to_vec());
            put(f64::to_le_bytes(v[1]).to_vec());
            put((v[2] as f32).to_le_bytes().to_vec());
        }
        for face in faces {
            put(vec![3]);
            face.iter().for_each(|v| put(v.to_le_bytes().to_vec()));
        }
    }
    for v in vertices {
        writeln!(ascii, "255 255 255 {} {} {}", v[0], v[1], v[2]).unwrap();
    }
    for f in faces {
        writeln!(ascii, " 3 {} {} {} ", f[0], f[1], f[2]).unwrap();
    }
    let [a, b, c] = [ascii.as_bytes(), &little, &big].map(|bytes| read(bytes, "ply").unwrap().mesh);
    assert_eq!(a, b);
    assert_eq!(a, c);
    assert_eq!(a.positions[2].y, 0.1);
    assert_eq!(a.appearance.corner_colours[3], [[1.0; 3]; 3]);
    // Any cut is told of, with the element at which it happens.
    for cut in 0..little.len() {
        assert!(read(&little[..cut], "ply").is_err(), "{cut}");
    }
    let fault = read(&little[..little.len() - 1], "ply").unwrap_err();
    assert_eq!(fault.to_string(), "the file ends inside face 4 of 4");
}
