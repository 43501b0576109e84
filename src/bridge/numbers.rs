//! Structures as lists of numbers: how they come from Java, which has no structures.

use super::fault::{Fault, Status};

/// A list that is read from its beginning.
pub struct Numbers<'a> {
    name: &'a str,
    rest: &'a [f64],
    read: usize,
}

impl<'a> Numbers<'a> {
    /// Of exactly `count` numbers.
    ///
    /// # Errors
    /// [`Status::BadArgument`] for another length.
    pub fn new(name: &'a str, numbers: &'a [f64], count: usize) -> Result<Self, Fault> {
        if numbers.len() != count {
            let text = format!("{name}: {} numbers, not {count}", numbers.len());
            return Err(Fault::new(Status::BadArgument, text));
        }
        Ok(Self {
            name,
            rest: numbers,
            read: 0,
        })
    }

    /// The next number.
    ///
    /// # Errors
    /// [`Status::BadArgument`] at the end.
    pub fn number(&mut self) -> Result<f64, Fault> {
        let Some((&first, rest)) = self.rest.split_first() else {
            let text = format!("{}: too few numbers", self.name);
            return Err(Fault::new(Status::BadArgument, text));
        };
        self.rest = rest;
        self.read += 1;
        Ok(first)
    }

    /// The next number, a count.
    ///
    /// # Errors
    /// [`Status::BadArgument`] for anything but a whole number from 0 to 2^32 - 1.
    pub fn count(&mut self) -> Result<u32, Fault> {
        let number = self.number()?;
        if number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number) {
            return Ok(number as u32);
        }
        let text = format!(
            "{}: number {} is {number}, not a whole number from 0 to 4294967295",
            self.name, self.read
        );
        Err(Fault::new(Status::BadArgument, text))
    }
}
