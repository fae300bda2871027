//! Numbers as text, fast.

/// A growing text.
pub(crate) struct Text<'a> {
    bytes: &'a mut Vec<u8>,
    number: zmij::Buffer,
}

impl<'a> Text<'a> {
    /// Goes on behind what is there.
    pub(crate) fn behind(bytes: &'a mut Vec<u8>) -> Self {
        Self { bytes, number: zmij::Buffer::new() }
    }

    pub(crate) fn raw(&mut self, text: &str) -> &mut Self {
        self.bytes.extend_from_slice(text.as_bytes());
        self
    }

    /// A blank before each of three numbers, which a reader gets back as the same f32.
    pub(crate) fn vector(&mut self, vector: [f64; 3]) -> &mut Self {
        for value in vector {
            self.bytes.push(b' ');
            self.bytes.extend_from_slice(self.number.format(value as f32).as_bytes());
        }
        self
    }

    /// " v//vn".
    pub(crate) fn corner(&mut self, vertex: u32, normal: u32) -> &mut Self {
        let vertex = Digits::of(vertex);
        self.bytes.push(b' ');
        self.bytes.extend_from_slice(vertex.text());
        self.bytes.extend_from_slice(b"//");
        let normal = Digits::of(normal);
        self.bytes.extend_from_slice(normal.text());
        self
    }
}

/// A number's decimal digits, at the end of the ten that 32 bits need.
struct Digits {
    digits: [u8; 10],
    start: usize,
}

impl Digits {
    fn of(mut number: u32) -> Self {
        let mut digits = [b'0'; 10];
        let mut start = digits.len() - 1;
        while number > 9 {
            digits[start] = b'0' + (number % 10) as u8;
            number /= 10;
            start -= 1;
        }
        digits[start] = b'0' + number as u8;
        Self { digits, start }
    }

    fn text(&self) -> &[u8] {
        &self.digits[self.start..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_as_the_standard_library_writes_them() {
        for number in [0, 1, 9, 10, 99, 100, 4_294_967_295] {
            assert_eq!(Digits::of(number).text(), number.to_string().as_bytes());
        }
    }
}
