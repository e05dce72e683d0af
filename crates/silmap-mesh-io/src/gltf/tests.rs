//! Small glTF files of every kind that is read, made here, with their right volumes and colours.

mod build;
mod colours;
mod compressed;
mod damage;
mod shapes;
