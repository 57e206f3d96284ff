-- Stand-ins for LinkRunCCA's tables that show whether it uses words that are read while they are written: they give
-- the opposite of each bit then. Only simulated.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity vhdl_table_ram_add is
    generic(
        data_width: positive;
        address_width: positive
    );
    port(
        clk: in std_logic;
        we: in std_logic;
        write_addr: in unsigned(address_width - 1 downto 0);
        data: in std_logic_vector(data_width - 1 downto 0);
        read_addr: in unsigned(address_width - 1 downto 0);
        q: out std_logic_vector(data_width - 1 downto 0)
    );
end;

architecture scrambled of vhdl_table_ram_add is
    type words is array(0 to 2**address_width - 1) of std_logic_vector(data_width - 1 downto 0);
    signal word: words;
    signal place: unsigned(address_width - 1 downto 0);
    signal collided: std_logic;
    signal stored: std_logic_vector(data_width - 1 downto 0);
begin
    process(clk)
    begin
        if rising_edge(clk) then
            place <= read_addr;
            collided <= '0';
            if we = '1' then
                word(to_integer(write_addr)) <= data;
                if write_addr = read_addr then
                    collided <= '1';
                end if;
            end if;
        end if;
    end process;

    stored <= word(to_integer(place));
    q <= not stored when collided = '1' else stored;
end;

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

use work.sheet.all;
use work.vhdl_linkruncca_pkg.all;

entity vhdl_table_ram_data is
    generic(
        address_width: positive
    );
    port(
        clk: in std_logic;
        we: in std_logic;
        write_addr: in unsigned(address_width - 1 downto 0);
        data: in linkruncca_feature_t;
        read_addr: in unsigned(address_width - 1 downto 0);
        q: out linkruncca_feature_t
    );
end;

architecture scrambled of vhdl_table_ram_data is
    constant bits: integer := area_bits + sum_x_bits + sum_y_bits;
    signal given, taken: std_logic_vector(bits - 1 downto 0);
begin
    given <= std_logic_vector(data.sum_y) & std_logic_vector(data.sum_x) & std_logic_vector(data.area);
    table: entity work.vhdl_table_ram_add
        generic map(
            data_width => bits,
            address_width => address_width
        )
        port map(
            clk => clk,
            we => we,
            write_addr => write_addr,
            data => given,
            read_addr => read_addr,
            q => taken
        );
    q.area <= unsigned(taken(area_bits - 1 downto 0));
    q.sum_x <= unsigned(taken(area_bits + sum_x_bits - 1 downto area_bits));
    q.sum_y <= unsigned(taken(bits - 1 downto area_bits + sum_x_bits));
end;
