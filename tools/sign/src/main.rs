//! `cargo xtask sign`: makes keys, signs images, and shows their content (docs/update.md).

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};
use bsp::update_layout::LAYOUT;
use clap::{Args, Parser, Subcommand};
use sign::product::{self, version};
use sign::{code, image::Image, key};
use update::{Description, Version};

/// Keys and signed images for the field update.
#[derive(Parser)]
#[command(name = "cargo xtask sign", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make a key pair: the secret half goes to a new file, the public half is printed as the variable that the bootloader is built with
    Key {
        /// The new file
        file: PathBuf,
    },
    /// Print the public half of a key
    Public {
        /// The secret key, PKCS#8 in PEM
        file: PathBuf,
    },
    /// Sign an application, an ELF file or a flat binary
    Image(ImageArgs),
    /// Show the content of an image, and check it
    Show {
        /// The image
        file: PathBuf,
        /// A secret key, to see whether it signed the image [default: the development key]
        #[arg(long)]
        key: Option<PathBuf>,
    },
}

#[derive(Args)]
struct ImageArgs {
    /// The ELF file, or the binary from 0x08020200 on
    file: PathBuf,
    /// The secret key, PKCS#8 in PEM [default: the development key, which is known to everybody]
    #[arg(long)]
    key: Option<PathBuf>,
    /// The board that the image is for, as in 2004h:1
    #[arg(long, value_parser = number, default_value_t = product::BOARD)]
    board: u32,
    /// The hardware revisions that the image runs on, 0 to 31, with commas
    #[arg(long, value_delimiter = ',', default_value = "0", value_parser = clap::value_parser!(u32).range(0..32))]
    hardware: Vec<u32>,
    /// The version of the image, as 1.2.3
    #[arg(long = "image-version", value_parser = version, default_value = env!("CARGO_PKG_VERSION"))]
    version: Version,
    /// The security counter: raise it when no older image may ever run again
    #[arg(long, default_value_t = 0)]
    counter: u32,
    /// The number of the key in the bootloader: 0 for UPDATE_PUBLIC_KEY, 1 for UPDATE_PUBLIC_KEY_2
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..2))]
    key_number: u8,
    /// A key that no node accepts any more where this image has run
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..2))]
    revokes: Option<u8>,
    /// The file for the image [default: the name of the file with .img]
    #[arg(long, short)]
    out: Option<PathBuf>,
}

fn number(text: &str) -> Result<u32> {
    Ok(match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16)?,
        None => text.parse()?,
    })
}

fn signing_key(path: Option<&Path>) -> Result<ed25519_dalek::SigningKey> {
    let development = key::development_path();
    let key = key::read(path.unwrap_or(&development))?;
    if key::is_development(&key) {
        eprintln!("warning: the development key is known to everybody");
    }
    Ok(key)
}

fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}

fn make_key(path: &Path) -> Result<()> {
    let key = key::random()?;
    key::write(&key, path)?;
    println!("{}", key::variable(&key));
    Ok(())
}

fn make_image(args: &ImageArgs) -> Result<()> {
    let key = signing_key(args.key.as_deref())?;
    let code = code::read(&read(&args.file)?).with_context(|| args.file.display().to_string())?;
    let hardware = args.hardware.iter().fold(0, |mask, revision| mask | 1 << revision);
    ensure!(
        args.counter <= LAYOUT.highest_counter(),
        "a node keeps counters up to {}, and not {}",
        LAYOUT.highest_counter(),
        args.counter
    );
    let revokes = args.revokes.iter().fold(0, |mask, number| mask | 1 << number);
    ensure!(revokes >> args.key_number & 1 == 0, "an image cannot revoke the key that it is signed with");
    let description = Description {
        board: args.board,
        hardware,
        version: args.version,
        counter: args.counter,
        key: args.key_number,
        revokes,
    };
    let image = Image::sign(description, code, &key)?;
    let out = args.out.clone().unwrap_or_else(|| args.file.with_extension("img"));
    std::fs::write(&out, image.to_bytes()).with_context(|| format!("cannot write {}", out.display()))?;
    show(&image);
    println!("file        {}", out.display());
    Ok(())
}

fn show(image: &Image) {
    let about = image.header.description();
    let revisions = (0..32).filter(|revision| about.hardware >> revision & 1 != 0);
    let revisions: Vec<_> = revisions.map(|revision: u32| revision.to_string()).collect();
    println!("version     {}", about.version);
    println!("board       {:#010x}", about.board);
    println!("hardware    {}", revisions.join(", "));
    println!("counter     {}", about.counter);
    println!("key         number {}", about.key);
    if let Some(revoked) = (0..8).find(|key| about.revokes >> key & 1 != 0) {
        println!("revokes     key number {revoked}");
    }
    println!("code        {} bytes, CRC-32 {:#010x} (1F56h)", image.header.length(), image.header.code_crc());
}

fn show_file(file: &Path, key: Option<&Path>) -> Result<()> {
    let image = Image::read(&read(file)?).with_context(|| file.display().to_string())?;
    show(&image);
    if !image.is_signed_by(&signing_key(key)?.verifying_key()) {
        bail!("it was not signed with this key");
    }
    println!("signature   good");
    Ok(())
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Key { file } => make_key(&file),
        Command::Public { file } => key::read(&file).map(|key| println!("{}", key::variable(&key))),
        Command::Image(args) => make_image(&args),
        Command::Show { file, key } => show_file(&file, key.as_deref()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
